#include "datagrams.hpp"

#include <sys/socket.h>
#include <sys/uio.h>
#include <algorithm>
#include <array>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "panelgate/base/network.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "request_reader.hpp"

namespace panelgate::tcp_server {

namespace {

using boost::asio::ip::udp;

/// Buffer for the one control message of a datagram.
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
            info.ipi_ifindex = 0;  // routing selects the interface
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

void enable_packet_info(udp::socket& socket) {
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

namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr int kDatagramsAtOnce = 64;  // per wake-up

/// Returns how many peers an address may have. Half of all is left to others even where
/// max_connections is small: a busy peer is not dropped for a newcomer, as a connection is
/// (find_place()), because its requests have been accepted (P3) and the newcomer's address may be
/// forged.
std::size_t peers_of_address(const Settings& settings) {
    return std::min(settings.udp_peers_per_address, (settings.max_connections + 1) / 2);
}

/// Returns the datagram's ADU; nullopt unless it is exactly one.
std::optional<modbus::Adu> adu_of(ByteView datagram) {
    modbus::MbapFramer framer;
    framer.feed(datagram);
    auto event = framer.next();
    if (!event || !std::holds_alternative<modbus::Adu>(*event)) return std::nullopt;
    auto adu = std::get<modbus::Adu>(std::move(*event));
    const std::size_t size = modbus::kMbapPrefix + 1 + adu.pdu.size();
    if (size != datagram.size()) return std::nullopt;
    return adu;
}

}  // namespace

Datagrams::Datagrams(const asio::any_io_executor& executor, std::shared_ptr<Shared> shared,
                     std::function<void()> on_idle)
    : socket_(executor),
      shared_(std::move(shared)),
      allowed_(shared_->settings.allow),
      on_idle_(std::move(on_idle)) {}

error_code Datagrams::open(const std::string& address, std::uint16_t port, bool ipv6_only) {
    error_code error;
    const Endpoint endpoint(asio::ip::make_address(address, error), port);
    if (!error) socket_.open(endpoint.protocol(), error);
    if (!error && endpoint.address().is_v6())
        socket_.set_option(asio::ip::v6_only(ipv6_only), error);
    if (!error) socket_.non_blocking(true, error);
    if (!error) socket_.bind(endpoint, error);
    if (error) {
        error_code ignored;
        socket_.close(ignored);
    } else {
        enable_packet_info(socket_);
        receive();
    }
    return error;
}

void Datagrams::receive() {
    socket_.async_wait(udp::socket::wait_read, [weak = weak_from_this()](const error_code& error) {
        const auto self = weak.lock();
        if (self && !error && self->socket_.is_open()) self->on_readable();
    });
}

void Datagrams::on_readable() {
    for (int i = 0; i < kDatagramsAtOnce && socket_.is_open(); ++i) {
        bool failed = false;
        const auto received = receive_datagram(socket_, input_, failed);
        if (!received && !failed) break;
        if (received && !finishing_) take(*received);
    }
    if (socket_.is_open()) receive();
}

void Datagrams::take(const Received& received) {
    const Endpoint& from = received.from;
    if (!allowed_.allows(from.address()))
        return log_refused(from, rt::LogLevel::info, "not in the allow list");
    auto adu = adu_of(ByteView(input_).first(received.size));
    if (!adu) return drop(received);
    Peer* sender = peer(from);
    if (sender == nullptr || !sender->pipeline->has_room()) {
        if (sender != nullptr && sender->pipeline->joins(*adu)) return;
        return refuse({from, received.to, adu->transaction, adu->unit, adu->pdu[0]});
    }
    sender->heard = shared_->clock.now();
    sender->asked = received.to;
    sender->pipeline->take(std::move(*adu));
    answer(from);
}

void Datagrams::drop(const Received& received) {
    ++shared_->counters.protocol_errors;
    const auto spoken =
        modbus::other_framing(modbus::Framing::tcp, ByteView(input_).first(received.size));
    if (!spoken) return;
    log_refused(received.from, rt::LogLevel::warn,
                "it speaks " + std::string(name_of(*spoken)) +
                    ", and datagrams are for Modbus/TCP; it needs a connection to a listener with "
                    "framing: " +
                    std::string(modbus::label(*spoken)));
}

/// Paced like all replies the gateway generates itself.
void Datagrams::refuse(const Busy& busy) {
    if (shared_->own_answers->try_acquire()) {
        send_busy(busy);
    } else if (busy_ < shared_->settings.udp_busy_answers) {
        ++busy_;
        shared_->own_answers->wait([weak = weak_from_this(), busy] {
            const auto self = weak.lock();
            if (!self) return false;
            --self->busy_;
            return self->send_busy(busy);
        });
    } else {
        log_refused(busy.to, rt::LogLevel::debug, "too many without room");
    }
}

/// False if the socket is already closed.
bool Datagrams::send_busy(const Busy& busy) {
    if (!socket_.is_open()) return false;
    ++shared_->counters.requests;
    ++shared_->counters.exceptions;
    ++shared_->counters.busy;
    const Bytes pdu =
        modbus::encode_exception(busy.function, modbus::ExceptionCode::server_device_busy);
    send_datagram(socket_, modbus::encode_mbap(busy.transaction, busy.unit, pdu), busy.to,
                  busy.from);
    return true;
}

void Datagrams::log_refused(const Endpoint& from, rt::LogLevel level, std::string reason) const {
    shared_->log(level, "datagram refused",
                 {{"client", endpoint_text(from.address().to_string(), from.port())},
                  {"reason", std::move(reason)}});
}

Datagrams::Peer* Datagrams::peer(const Endpoint& from) {
    if (const auto known = peers_.find(from); known != peers_.end()) return &known->second;
    if (!make_room(from)) return nullptr;
    const std::string address = from.address().to_string();
    std::string name = endpoint_text(address, from.port()) + " udp";
    WhoRef who = make_who({.face = Face::udp,
                           .name = "modbus_tcp " + name,
                           .address = address,
                           .listener = shared_->settings.name(),
                           .standing = Role::operator_});
    Caller caller(std::move(name), std::move(who));
    const auto on_answer = [weak = weak_from_this(), from] {
        if (const auto self = weak.lock()) self->answer(from);
    };
    Peer made{std::make_shared<Pipeline>(shared_, std::move(caller), on_answer,
                                         Pipeline::Transport::datagrams)};
    return &peers_.emplace(from, std::move(made)).first->second;
}

/// Source addresses can be spoofed, so each has few slots, and an idle peer gives its slot up.
bool Datagrams::make_room(const Endpoint& from) {
    const asio::ip::address address = from.address();
    const auto of_address = std::ranges::count_if(
        peers_, [&](const auto& peer) { return peer.first.address() == address; });
    evict_idle(shared_->clock.now());
    const Settings& settings = shared_->settings;
    if (static_cast<std::size_t>(of_address) >= peers_of_address(settings) &&
        !evict_longest_idle(&address))
        return false;
    return peers_.size() < settings.max_connections || evict_longest_idle(nullptr);
}

void Datagrams::evict_idle(TimePoint now) {
    std::erase_if(peers_, [&](const auto& peer) {
        const bool gone =
            peer.second.pipeline->empty() && now - peer.second.heard >= shared_->settings.udp_idle;
        if (gone) peer.second.pipeline->close();
        return gone;
    });
}

/// Drops the longest-idle peer of one address, or of all if null. False if all await answers.
bool Datagrams::evict_longest_idle(const asio::ip::address* address) {
    auto longest = peers_.end();
    for (auto peer = peers_.begin(); peer != peers_.end(); ++peer) {
        if (address != nullptr && peer->first.address() != *address) continue;
        if (!peer->second.pipeline->empty()) continue;
        if (longest == peers_.end() || peer->second.heard < longest->second.heard) longest = peer;
    }
    if (longest == peers_.end()) return false;
    longest->second.pipeline->close();
    peers_.erase(longest);
    return true;
}

void Datagrams::answer(const Endpoint& to) {
    const auto found = peers_.find(to);
    if (found == peers_.end() || !socket_.is_open()) return;
    const std::shared_ptr<Pipeline> pipeline = found->second.pipeline;
    const OwnAddress asked = found->second.asked;
    while (const Bytes* adu = pipeline->front()) {
        send_datagram(socket_, *adu, to, asked);
        pipeline->pop();
    }
    if (finishing_ && idle()) on_idle_();
}

bool Datagrams::idle() const {
    return std::ranges::all_of(peers_,
                               [](const auto& peer) { return peer.second.pipeline->empty(); });
}

void Datagrams::finish() {
    finishing_ = true;
    const Peers peers = peers_;
    for (const auto& [endpoint, peer] : peers) {
        peer.pipeline->refuse_waiting();
        answer(endpoint);
    }
    if (idle() && on_idle_) on_idle_();
}

void Datagrams::close() {
    error_code ignored;
    socket_.close(ignored);
    for (auto& [endpoint, peer] : std::exchange(peers_, {})) peer.pipeline->close();
    if (const auto told = std::exchange(on_idle_, nullptr)) told();
}

}  // namespace panelgate::tcp_server
