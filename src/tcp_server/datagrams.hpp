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

/// Which address of ours somebody has sent to: a socket that listens on all of them would answer
/// from any, and who has asked another one does not take that.
using OwnAddress = std::variant<std::monostate, in_pktinfo, in6_pktinfo>;

/// Has the system tell it of each datagram. What it does not tell is not known.
void ask_for_own_address(boost::asio::ip::udp::socket& socket);

struct Received {
    std::size_t size = 0;  ///< at most what there was room for
    boost::asio::ip::udp::endpoint from;
    OwnAddress to;
};
/// The next datagram that waits, if there is one. `failed`: something else was there, such as what
/// the network says of an earlier answer.
std::optional<Received> receive_datagram(boost::asio::ip::udp::socket& socket,
                                         std::span<std::uint8_t> into, bool& failed);
/// What the system does not take now is lost, as datagrams are.
void send_datagram(boost::asio::ip::udp::socket& socket, ByteView datagram,
                   const boost::asio::ip::udp::endpoint& to, const OwnAddress& from);

/// Modbus/TCP's ADUs in datagrams, one in each; answers go to the sender. Whoever sends (address
/// and port) has a pipeline like a connection, until it has been idle for a while. What comes
/// without room is answered 06, which keeps nothing but its place among the own answers. What is no
/// ADU is dropped and counted; another framing is told in the log. One thread; held by a
/// shared_ptr.
class Datagrams : public std::enable_shared_from_this<Datagrams> {
  public:
    /// `on_idle`: after finish(), all that was taken has been answered; perhaps more than once.
    /// Also by close(), and then never again.
    Datagrams(const boost::asio::any_io_executor& executor, std::shared_ptr<Shared> shared,
              std::function<void()> on_idle);

    /// Binds and receives. What is wrong, or nothing; then it may be tried again.
    boost::system::error_code open(const std::string& address, std::uint16_t port, bool ipv6_only);
    void allow(const rt::AccessList& allowed) { allowed_ = allowed; }
    /// Takes no more, answers what is on the lines, turns away what waits.
    void finish();
    /// At once; requests that wait are taken back from their buses. May be called twice.
    void close();
    /// Nobody waits for an answer.
    bool idle() const;

  private:
    using Endpoint = boost::asio::ip::udp::endpoint;
    struct Peer {
        std::shared_ptr<Pipeline> pipeline;
        TimePoint heard{};
        OwnAddress asked{};  ///< which answers then
    };
    using Peers = std::map<Endpoint, Peer>;

    /// What is needed to answer 06.
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
    void forget_idle(TimePoint now);
    bool forget_longest_idle(const boost::asio::ip::address* address);
    void answer(const Endpoint& to);
    void drop(const Received& received);
    void refuse(const Busy& busy);
    bool tell_busy(const Busy& busy);
    void log_refused(const Endpoint& from, rt::LogLevel level, std::string reason) const;

    boost::asio::ip::udp::socket socket_;
    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    std::function<void()> on_idle_;
    Peers peers_;
    std::array<std::uint8_t, modbus::kMaxTcpAdu + 1> input_{};  ///< one more: it is too long
    std::size_t busy_ = 0;  ///< answers 06 that wait for their turn
    bool finishing_ = false;
};

}  // namespace panelgate::tcp_server
