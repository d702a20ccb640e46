#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/compose.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "panelgate/base/time.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::tls {

class Engine;
class Proof;

/// What has come is no TLS, or was changed on the way.
inline constexpr auto kDamaged = boost::system::errc::protocol_error;

/// A connection, plain or with TLS, chosen at run time: plain until secure(). Meets Asio's
/// AsyncReadStream and AsyncWriteStream. One read and one write at a time; whoever owns it keeps it
/// alive until both have ended. Never blocks. One thread.
class Stream {
  public:
    using executor_type = boost::asio::any_io_executor;
    /// What has arrived and is not read.
    enum class Input : std::uint8_t { none, bytes, end, broken };

    explicit Stream(boost::asio::ip::tcp::socket socket);
    ~Stream();
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    /// From now on it speaks TLS; the handshake is over.
    void secure(std::shared_ptr<Engine> engine);
    bool is_secure() const { return engine_ != nullptr; }
    /// Who is at the other end; nobody before secure().
    const Peer& peer() const { return peer_; }
    /// What it has shown; null before secure().
    std::shared_ptr<const Proof> proof() const;

    executor_type get_executor() { return socket_.get_executor(); }
    /// For its addresses, options and wait operations. Bytes go through this class.
    boost::asio::ip::tcp::socket& socket() { return socket_; }
    const boost::asio::ip::tcp::socket& socket() const { return socket_; }

    template <class Buffers, class Token>
    auto async_read_some(const Buffers& buffers, Token&& token);
    template <class Buffers, class Token>
    auto async_write_some(const Buffers& buffers, Token&& token);
    /// The same without a time limit (expires_after): a plain one costs what the socket's own does.
    template <class Handler>
    void read_some(boost::asio::mutable_buffer into, Handler handler);
    /// Writes what can be written at once; would_block if nothing. After would_block the next write
    /// must begin with the same bytes, and have as many of them or more.
    std::size_t write_some(boost::asio::const_buffer bytes, boost::system::error_code& error);
    /// Looks without reading; only while no read is pending.
    Input look();
    /// Bytes in the socket that are not read, encrypted or not.
    std::size_t available() const;
    /// True if the kernel holds nothing that the client has not acknowledged.
    bool all_is_sent() const;

    /// If an operation is pending by then, it fails and the connection is closed.
    void expires_after(Duration patience);
    /// Tells the client that nothing more is sent.
    void shutdown_send();
    /// Idempotent. Pending operations fail.
    void close();

  private:
    enum class Need : std::uint8_t { nothing, readable, writable };
    struct Step {
        std::size_t bytes = 0;
        boost::system::error_code error{};
        Need need = Need::nothing;
    };
    struct Reading;
    struct Writing;
    template <class Buffers, class Way>
    struct Transfer;

    // The encrypted bytes that a read waits for: see Engine.
    bool holds_input() const;
    boost::asio::mutable_buffer room();
    void arrived(std::size_t size);

    Step read_secure(boost::asio::mutable_buffer into);
    Step write_secure(boost::asio::const_buffer bytes);
    Step step_of(int result);

    template <class Op>
    void wait(Need need, Op&& op) {
        const auto what = need == Need::writable ? boost::asio::ip::tcp::socket::wait_write
                                                 : boost::asio::ip::tcp::socket::wait_read;
        socket_.async_wait(what, std::forward<Op>(op));
    }

    boost::asio::ip::tcp::socket socket_;
    std::shared_ptr<Engine> engine_;  ///< null: plain
    Peer peer_;
    boost::asio::steady_timer timer_;
    int pending_ = 0;  ///< operations
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

/// The first buffer that is not empty.
template <class Buffer, class Buffers>
Buffer first_of(const Buffers& buffers) {
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (auto at = boost::asio::buffer_sequence_begin(buffers); at != end; ++at) {
        const Buffer one(*at);
        if (one.size() > 0) return one;
    }
    return {};
}

struct Stream::Reading {
    template <class Buffers, class Self>
    static void plain(boost::asio::ip::tcp::socket& socket, const Buffers& into, Self&& self) {
        socket.async_read_some(into, std::forward<Self>(self));
    }
    /// It waits by reading: one call of the system fewer than by waiting until something is there.
    static bool takes(Need need) { return need == Need::readable; }
    template <class Buffers>
    static bool must_wait(const Stream& on, const Buffers& into) {
        return boost::asio::buffer_size(into) > 0 && !on.holds_input();
    }
    template <class Buffers>
    Step secure(Stream& on, const Buffers& into) {
        return on.read_secure(first_of<boost::asio::mutable_buffer>(into));
    }
};

/// Several small buffers become one record, which is the same when it is tried again.
struct Stream::Writing {
    static constexpr std::size_t kRecord = 16 * 1024;

    std::string gathered{};

    template <class Buffers, class Self>
    static void plain(boost::asio::ip::tcp::socket& socket, const Buffers& from, Self&& self) {
        socket.async_write_some(from, std::forward<Self>(self));
    }
    static bool takes(Need) { return false; }
    template <class Buffers>
    static bool must_wait(const Stream&, const Buffers&) {
        return false;
    }
    template <class Buffers>
    Step secure(Stream& on, const Buffers& from) {
        return on.write_secure(record(from));
    }
    template <class Buffers>
    boost::asio::const_buffer record(const Buffers& buffers) {
        const auto first = first_of<boost::asio::const_buffer>(buffers);
        const std::size_t all = boost::asio::buffer_size(buffers);
        if (first.size() == all || first.size() >= kRecord) return first;
        if (gathered.empty()) {
            gathered.resize(std::min(kRecord, all));
            boost::asio::buffer_copy(boost::asio::buffer(gathered), buffers);
        }
        return boost::asio::buffer(gathered);
    }
};

/// One read or write, as `Way` does it.
template <class Buffers, class Way>
struct Stream::Transfer {
    enum class At : std::uint8_t { begin, plain, waited, filled, posted };

    Stream& stream;
    Buffers buffers;
    At at = At::begin;
    Step step{};
    Way way{};

    template <class Self>
    void operator()(Self& self, boost::system::error_code error = {}, std::size_t size = 0) {
        Stream& on = stream;
        if (at == At::begin && !on.is_secure()) {
            at = At::plain;
            const Buffers all = buffers;
            return Way::plain(on.socket_, all, std::move(self));
        }
        if (at == At::plain) return end(self, error, size);
        if (at == At::posted) return end(self, step.error, step.bytes);
        if (at == At::begin && Way::must_wait(on, buffers)) return fill(self);
        if (at == At::filled) on.arrived(size);
        // The end of the socket's input is one for OpenSSL to judge.
        if (error && error != boost::asio::error::eof) return end(self, error, 0);
        step = way.secure(on, buffers);
        if (Way::takes(step.need)) return fill(self);
        if (step.need != Need::nothing) {
            at = At::waited;
            return on.wait(step.need, std::move(self));
        }
        if (at != At::begin) return end(self, step.error, step.bytes);
        at = At::posted;  // no handler may run inside of the call that begins it
        boost::asio::post(on.get_executor(), std::move(self));
    }
    template <class Self>
    void fill(Self& self) {
        at = At::filled;
        Stream& on = stream;
        on.socket_.async_read_some(boost::asio::buffer(on.room()), std::move(self));
    }
    template <class Self>
    void end(Self& self, boost::system::error_code error, std::size_t size) {
        --stream.pending_;
        self.complete(error, size);
    }
};

template <class Buffers, class Token>
auto Stream::async_read_some(const Buffers& buffers, Token&& token) {
    ++pending_;
    return boost::asio::async_compose<Token, void(boost::system::error_code, std::size_t)>(
        Transfer<Buffers, Reading>{*this, buffers}, token, socket_);
}

template <class Handler>
void Stream::read_some(boost::asio::mutable_buffer into, Handler handler) {
    if (is_secure()) return async_read_some(into, std::move(handler));
    socket_.async_read_some(into, std::move(handler));
}

template <class Buffers, class Token>
auto Stream::async_write_some(const Buffers& buffers, Token&& token) {
    ++pending_;
    return boost::asio::async_compose<Token, void(boost::system::error_code, std::size_t)>(
        Transfer<Buffers, Writing>{*this, buffers}, token, socket_);
}

}  // namespace panelgate::tls
