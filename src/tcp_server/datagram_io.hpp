#pragma once

#include <netinet/in.h>

#include <boost/asio/ip/udp.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "panelgate/base/bytes.hpp"

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

}  // namespace panelgate::tcp_server
