#include "datagram_io.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace panelgate::tcp_server {
namespace {

using boost::asio::ip::udp;

/// Room for the one message beside a datagram.
struct alignas(cmsghdr) Control {
    std::array<std::byte, CMSG_SPACE(sizeof(in6_pktinfo))> bytes{};
};

template <class Info>
Info info_of(const cmsghdr& message) {
    Info info{};
    std::memcpy(&info, CMSG_DATA(&message), sizeof info);
    return info;
}

OwnAddress own_address(msghdr& message) {
    for (cmsghdr* one = CMSG_FIRSTHDR(&message); one != nullptr; one = CMSG_NXTHDR(&message, one)) {
        if (one->cmsg_level == IPPROTO_IP && one->cmsg_type == IP_PKTINFO) {
            auto info = info_of<in_pktinfo>(*one);
            info.ipi_ifindex = 0;  // the routes say by which interface
            info.ipi_spec_dst = info.ipi_addr;
            return info;
        }
        if (one->cmsg_level == IPPROTO_IPV6 && one->cmsg_type == IPV6_PKTINFO) {
            auto info = info_of<in6_pktinfo>(*one);
            const bool link_local = IN6_IS_ADDR_LINKLOCAL(&info.ipi6_addr);
            if (!link_local) info.ipi6_ifindex = 0;
            return info;
        }
    }
    return {};
}

template <class Info>
void put(msghdr& message, Control& control, int level, int type, const Info& info) {
    message.msg_control = control.bytes.data();
    message.msg_controllen = CMSG_SPACE(sizeof info);
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = level;
    header->cmsg_type = type;
    header->cmsg_len = CMSG_LEN(sizeof info);
    std::memcpy(CMSG_DATA(header), &info, sizeof info);
}

}  // namespace

void ask_for_own_address(udp::socket& socket) {
    boost::system::error_code error;
    const bool six = socket.local_endpoint(error).address().is_v6();
    const int on = 1;
    if (six) {
        ::setsockopt(socket.native_handle(), IPPROTO_IPV6, IPV6_RECVPKTINFO, &on, sizeof on);
    } else {
        ::setsockopt(socket.native_handle(), IPPROTO_IP, IP_PKTINFO, &on, sizeof on);
    }
}

std::optional<Received> receive_datagram(udp::socket& socket, std::span<std::uint8_t> into,
                                         bool& failed) {
    Received received;
    Control control;
    iovec part{into.data(), into.size()};
    msghdr message{};
    message.msg_name = received.from.data();
    message.msg_namelen = static_cast<socklen_t>(received.from.capacity());
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.bytes.data();
    message.msg_controllen = control.bytes.size();
    const ssize_t size = ::recvmsg(socket.native_handle(), &message, 0);
    failed = size < 0 && errno != EAGAIN && errno != EWOULDBLOCK;
    if (size < 0) return std::nullopt;
    received.size = static_cast<std::size_t>(size);
    received.from.resize(message.msg_namelen);
    received.to = own_address(message);
    return received;
}

void send_datagram(udp::socket& socket, ByteView datagram, const udp::endpoint& to,
                   const OwnAddress& from) {
    Control control;
    udp::endpoint name = to;
    Bytes bytes(datagram.begin(), datagram.end());  // an iovec may be written to
    iovec part{bytes.data(), bytes.size()};
    msghdr message{};
    message.msg_name = name.data();
    message.msg_namelen = static_cast<socklen_t>(name.size());
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (const auto* four = std::get_if<in_pktinfo>(&from))
        put(message, control, IPPROTO_IP, IP_PKTINFO, *four);
    if (const auto* six = std::get_if<in6_pktinfo>(&from))
        put(message, control, IPPROTO_IPV6, IPV6_PKTINFO, *six);
    ::sendmsg(socket.native_handle(), &message, 0);
}

}  // namespace panelgate::tcp_server
