#pragma once

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "panelgate/modbus/framing.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "pipeline.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// Modbus/TCP over UDP, one ADU per datagram; replies go to the sender. Each sender (address and
/// port) has a pipeline like a connection, until another sender needs the place of an idle one.
/// Datagrams without room are dropped, as the network does; invalid ADUs are, too, and counted. A
/// reply leaves from the address that the socket is bound to; from a wildcard socket, from the one
/// that routing chooses. Single-threaded; owned by a shared_ptr.
class Datagrams : public std::enable_shared_from_this<Datagrams> {
  public:
    Datagrams(const boost::asio::any_io_executor& executor, std::shared_ptr<Shared> shared);

    /// Binds and starts to receive. Returns the error, if any; may then be called again.
    boost::system::error_code open(const std::string& address, std::uint16_t port, bool ipv6_only);
    void allow(const rt::AccessList& allowed) { allowed_ = allowed; }
    /// Takes no more requests, answers those on the lines, refuses queued ones. `on_answer` is
    /// called for each answer, and not after close().
    void finish(std::function<void()> on_answer);
    /// Closes at once and cancels queued requests on the buses. Idempotent.
    void close();
    /// True if no request is outstanding.
    bool idle() const;

  private:
    using Endpoint = boost::asio::ip::udp::endpoint;
    struct Peer {
        std::uint64_t host = 0;  ///< its address
        std::shared_ptr<Pipeline> pipeline;
        TimePoint heard{};
    };

    void receive();
    void on_readable();
    void take(ByteView datagram, const Endpoint& from);
    Peer* peer(const Endpoint& from);
    bool make_room(std::uint64_t host);
    void answer(const Endpoint& to);

    boost::asio::ip::udp::socket socket_;
    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    std::function<void()> on_answer_;  ///< null until finish()
    std::map<Endpoint, Peer> peers_;
    std::array<std::uint8_t, modbus::kMaxTcpAdu + 1> input_{};  ///< one more detects oversize
};

}  // namespace panelgate::tcp_server
