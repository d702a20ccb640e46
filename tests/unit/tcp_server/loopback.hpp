#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "held_bus.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::tcp_server {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

/// Runs the loop until a condition is true; false after a generous timeout.
inline bool run_until(asio::io_context& context, const std::function<bool()>& reached) {
    for (int turn = 0; turn < 2000; ++turn) {
        if (reached()) return true;
        context.restart();
        context.run_one_for(std::chrono::milliseconds(10));
    }
    return reached();
}

inline Bytes operator+(Bytes left, const Bytes& right) {
    left.insert(left.end(), right.begin(), right.end());
    return left;
}

/// A request to read one register of a station, identified by its address.
inline Bytes read_pdu(std::uint16_t address) { return Writer().u8(3).u16(address).u16(1).take(); }
inline Bytes reply_to_read(std::uint16_t value) { return Writer().u8(3).u8(2).u16(value).take(); }
/// The reply to Client::read(number).
inline modbus::Adu read_reply(std::uint16_t number) { return {number, 1, reply_to_read(number)}; }
/// What Client::read() sends for 0 to `count` - 1.
inline Bytes reads(std::uint16_t count) {
    Bytes stream;
    for (std::uint16_t i = 0; i < count; ++i)
        stream = stream + modbus::encode_mbap(i, 1, read_pdu(i));
    return stream;
}

/// A client in the same thread: it runs the loop while it waits.
class Client {
  public:
    Client(asio::io_context& context, std::uint16_t port, int receive_buffer = 0,
           const char* own_address = "127.0.0.1")
        : context_(context), socket_(context) {
        const tcp::endpoint server(asio::ip::address_v4::loopback(), port);
        socket_.open(tcp::v4());
        if (receive_buffer != 0) {
            socket_.set_option(tcp::socket::receive_buffer_size(receive_buffer));
        }
        socket_.bind({asio::ip::make_address(own_address), 0});
        socket_.connect(server);
        socket_.set_option(tcp::no_delay(true));
        socket_.non_blocking(true);
    }

    /// Sends what the socket accepts now; returns the number of bytes, nullopt if the connection is
    /// closed.
    std::optional<std::size_t> try_send(ByteView bytes) {
        error_code error;
        const std::size_t n = socket_.write_some(asio::buffer(bytes.data(), bytes.size()), error);
        if (error == asio::error::would_block) return 0;
        if (error) return std::nullopt;
        return n;
    }
    void send(ByteView bytes) {
        while (!bytes.empty()) {
            const auto n = try_send(bytes);
            ASSERT_TRUE(n.has_value()) << "the server closed";
            bytes = bytes.subspan(*n);
            if (*n == 0) context_.run_one_for(std::chrono::milliseconds(10));
        }
    }
    void request(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
        send(modbus::encode_mbap(transaction, unit, pdu));
    }
    /// Reads the register of this number from unit 1, with this transaction id.
    void read(std::uint16_t number) { request(number, 1, read_pdu(number)); }

    /// Returns the next reply; nullopt if the connection was closed.
    std::optional<modbus::Adu> receive() {
        std::optional<modbus::Adu> reply;
        run_until(context_, [&] {
            pull();
            if (auto event = framer_.next()) reply = std::get<modbus::Adu>(std::move(*event));
            return reply.has_value() || closed_;
        });
        EXPECT_TRUE(reply || closed_) << "neither a reply nor the end came";
        return reply;
    }
    /// True once that many bytes have arrived.
    bool has_bytes(std::size_t count) {
        pull();
        return raw_.size() >= count;
    }
    /// Returns the next `count` raw bytes; fewer if the connection was closed.
    Bytes receive_bytes(std::size_t count) {
        run_until(context_, [&] { return has_bytes(count) || closed_; });
        const std::size_t given = std::min(count, raw_.size());
        const auto end = raw_.begin() + static_cast<std::ptrdiff_t>(given);
        Bytes bytes(raw_.begin(), end);
        raw_.erase(raw_.begin(), end);
        return bytes;
    }
    /// Sends a request and returns the PDU of the next reply.
    Bytes ask(std::uint8_t unit, const Bytes& pdu) {
        request(++last_transaction_, unit, pdu);
        const auto reply = receive();
        if (!reply) return {};
        EXPECT_EQ(reply->transaction, last_transaction_);
        EXPECT_EQ(reply->unit, unit);
        return reply->pdu;
    }
    bool sees_close() {
        return run_until(context_, [&] {
            pull();
            return closed_;
        });
    }
    /// True if it was reset: data in transit to it may be lost.
    bool was_reset() const { return reset_; }
    /// True if there is unread input.
    bool has_input() {
        pull();
        return received_ != 0;
    }

    void shutdown_send() { socket_.shutdown(tcp::socket::shutdown_send); }
    void close() { socket_.close(); }
    /// Closes with a reset.
    void reset() {
        socket_.set_option(asio::socket_base::linger(true, 0));
        socket_.close();
    }
    tcp::socket& socket() { return socket_; }

  private:
    void pull() {
        std::array<std::uint8_t, 4096> chunk{};
        error_code error;
        const std::size_t n = socket_.read_some(asio::buffer(chunk), error);
        if (error && error != asio::error::would_block) closed_ = true;
        if (error == asio::error::connection_reset) reset_ = true;
        received_ += n;
        framer_.feed(ByteView(chunk.data(), n));
        raw_.insert(raw_.end(), chunk.begin(), chunk.begin() + n);
    }

    asio::io_context& context_;
    tcp::socket socket_;
    modbus::MbapFramer framer_;
    Bytes raw_;
    std::uint16_t last_transaction_ = 100;
    std::size_t received_ = 0;
    bool closed_ = false;
    bool reset_ = false;
};

/// A listener on a free loopback port with two lines: floor1 (stations 1 and 2, the second read
/// only) and floor2 (stations 11 and 12).
class Loopback : public ::testing::Test {
  protected:
    Loopback() {
        settings.port = 0;
        settings.lines = {"floor1"};
        settings.diagnostics_unit = 255;
        lines = {{"floor1", &bus1, {1, 2}, true}, {"floor2", &bus2, {11, 12}, true}};
        bus1.protect(2);
    }
    ~Loopback() override {
        listener.reset();
        context.restart();
        context.poll();
    }

    void start() {
        listener = std::make_unique<Listener>(context.get_executor(), clock, settings,
                                              UnitMap(settings, lines), "1.2.3");
        listener->start();
    }
    /// Starts the listener if there is none.
    Client connect(const char* own_address = "127.0.0.1", int receive_buffer = 0) {
        if (!listener) start();
        return Client(context, listener->port(), receive_buffer, own_address);
    }
    Counters counters() const { return listener->counters(); }
    void stop() {
        listener->stop([this] { stopped = true; });
    }

    bool run_until(const std::function<bool()>& reached) {
        return tcp_server::run_until(context, reached);
    }
    bool run_until_stopped() {
        return run_until([&] { return stopped; });
    }
    /// Runs until an alarm is armed: input so far has started the partial-ADU timeout.
    bool run_until_armed(std::size_t count = 1) {
        return run_until([&] { return clock.armed() == count; });
    }
    bool run_until_pending(std::size_t count) {
        return run_until([&] { return bus1.held.size() == count; });
    }
    bool run_until_errors(std::uint64_t count) {
        return run_until([&] { return counters().protocol_errors == count; });
    }
    bool run_until_connections(std::uint64_t count) {
        return run_until([&] { return counters().connections == count; });
    }
    /// Runs what is ready, and what that makes ready.
    void do_all_that_is_due() {
        context.restart();
        while (context.poll() != 0) {
        }
    }
    /// Makes a request that is then the last of `pending` on the bus.
    void read(Client& client, std::uint16_t number, std::size_t pending) {
        client.read(number);
        ASSERT_TRUE(run_until_pending(pending));
    }
    /// True if the client is answered what the bus says at once.
    bool is_served(Client& client) { return client.ask(1, read_pdu(1)) == bus1.instant; }
    /// Answers one request on the bus and returns the client's reply.
    Bytes ask_bus(Client& client, std::uint8_t unit, const Bytes& pdu, const Result<Bytes>& answer,
                  bool transmitted = true) {
        client.request(7, unit, pdu);
        EXPECT_TRUE(run_until_pending(1));
        bus1.answer(0, answer, transmitted);
        const auto reply = client.receive();
        return reply ? reply->pdu : Bytes{};
    }
    /// The bus answers reads `first` to `end` - 1 in turn, and each answer is the client's next
    /// reply.
    void expect_values(Client& client, std::uint16_t first, std::uint16_t end) {
        for (std::uint16_t i = first; i < end; ++i) {
            ASSERT_TRUE(run_until([&] { return !bus1.held.empty(); }));
            ASSERT_LE(bus1.held.size(), settings.in_flight);
            ASSERT_EQ(bus1.held[0].request.request.pdu(), read_pdu(i));
            bus1.answer(0, reply_to_read(i));
            ASSERT_EQ(client.receive(), read_reply(i));
        }
    }

    asio::io_context context;
    test::ManualClock clock;  ///< moved only by the tests
    ManualBus bus1{context};
    ManualBus bus2{context};
    Settings settings;
    std::vector<LineInfo> lines;
    rt::LogTap log;
    bool stopped = false;  ///< what stop() waits for
    std::unique_ptr<Listener> listener;
};

}  // namespace panelgate::tcp_server
