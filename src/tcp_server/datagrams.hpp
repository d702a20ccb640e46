#pragma once

#include <netinet/in.h>
#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "pipeline.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// The local address a datagram was sent to: a wildcard socket could reply from any address, and
/// the client would not accept that.
using OwnAddress = std::variant<std::monostate, in_pktinfo, in6_pktinfo>;

/// Makes the system report it for each datagram. On failure it stays unknown.
void enable_packet_info(boost::asio::ip::udp::socket& socket);

struct Received {
    std::size_t size = 0;  ///< at most the buffer's size
    boost::asio::ip::udp::endpoint from;
    OwnAddress to;
};
/// Receives the next datagram, if any. `failed`: something else was pending, such as an ICMP error
/// about an earlier answer.
std::optional<Received> receive_datagram(boost::asio::ip::udp::socket& socket,
                                         std::span<std::uint8_t> into, bool& failed);
/// Sends without waiting; a datagram the system does not accept is lost.
void send_datagram(boost::asio::ip::udp::socket& socket, ByteView datagram,
                   const boost::asio::ip::udp::endpoint& to, const OwnAddress& from);

/// Modbus/TCP over UDP, one ADU per datagram; replies go to the sender. Each sender (address and
/// port) has a pipeline like a connection until it has been idle for a while. A request without
/// room is answered 06, which takes only a slot among the own answers. Invalid ADUs are dropped and
/// counted; another framing is logged. Single-threaded; owned by a shared_ptr.
class Datagrams : public std::enable_shared_from_this<Datagrams> {
  public:
    /// `on_idle` is called after finish() once all requests are answered, perhaps repeatedly; also
    /// by close(), for the last time.
    Datagrams(const boost::asio::any_io_executor& executor, std::shared_ptr<Shared> shared,
              std::function<void()> on_idle);

    /// Binds and starts to receive. Returns the error, if any; it may then be called again.
    boost::system::error_code open(const std::string& address, std::uint16_t port, bool ipv6_only);
    void allow(const rt::AccessList& allowed) { allowed_ = allowed; }
    /// Takes no more requests, answers those on the lines, refuses queued ones.
    void finish();
    /// Closes at once and cancels queued requests on the buses. Idempotent.
    void close();
    /// True if no request is outstanding.
    bool idle() const;

  private:
    using Endpoint = boost::asio::ip::udp::endpoint;
    struct Peer {
        std::shared_ptr<Pipeline> pipeline;
        TimePoint heard{};
        OwnAddress asked{};  ///< the address to reply from
    };
    using Peers = std::map<Endpoint, Peer>;

    /// What an exception 06 needs.
    struct Busy {
        Endpoint to;
        OwnAddress from;
        std::uint16_t transaction = 0;
        std::uint8_t unit = 0;
        std::uint8_t function = 0;
    };

    void receive();
    void on_readable();
    void take(const Received& received);
    Peer* peer(const Endpoint& from);
    bool make_room(const Endpoint& from);
    void evict_idle(TimePoint now);
    bool evict_longest_idle(const boost::asio::ip::address* address);
    void answer(const Endpoint& to);
    void drop(const Received& received);
    void refuse(const Busy& busy);
    bool send_busy(const Busy& busy);
    void log_refused(const Endpoint& from, rt::LogLevel level, std::string reason) const;

    boost::asio::ip::udp::socket socket_;
    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    std::function<void()> on_idle_;
    Peers peers_;
    std::array<std::uint8_t, modbus::kMaxTcpAdu + 1> input_{};  ///< one more detects oversize
    std::size_t busy_ = 0;                                      ///< exceptions 06 queued
    bool finishing_ = false;
};

}  // namespace panelgate::tcp_server
