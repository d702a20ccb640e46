#include "datagrams.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "places.hpp"

namespace panelgate::tcp_server {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr int kDatagramsAtOnce = 64;  // per wake-up

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

Datagrams::Datagrams(const asio::any_io_executor& executor, std::shared_ptr<Shared> shared)
    : socket_(executor), shared_(std::move(shared)), allowed_(shared_->settings.allow) {}

error_code Datagrams::open(const std::string& address, std::uint16_t port, bool ipv6_only) {
    error_code error;
    const Endpoint endpoint(asio::ip::make_address(address, error), port);
    if (!error) socket_.open(endpoint.protocol(), error);
    if (!error && endpoint.address().is_v6())
        socket_.set_option(asio::ip::v6_only(ipv6_only), error);
    if (!error) socket_.non_blocking(true, error);
    if (!error) socket_.bind(endpoint, error);
    error_code ignored;
    error ? void(socket_.close(ignored)) : receive();
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
        Endpoint from;
        error_code error;  // also an ICMP error about an earlier reply
        const std::size_t size = socket_.receive_from(asio::buffer(input_), from, 0, error);
        if (error == asio::error::would_block) break;
        if (!error && !on_answer_) take(ByteView(input_).first(size), from);
    }
    if (socket_.is_open()) receive();
}

void Datagrams::take(ByteView datagram, const Endpoint& from) {
    if (!allowed_.allows(from.address()))
        return shared_->log(rt::LogLevel::info, "datagram refused",
                            {{"client", endpoint_text(from.address().to_string(), from.port())},
                             {"reason", "not in the allow list"}});
    auto adu = adu_of(datagram);
    if (!adu) {
        ++shared_->counters.protocol_errors;
        return;
    }
    Peer* sender = peer(from);
    if (sender == nullptr || !sender->pipeline->has_room()) {
        ++shared_->counters.refused;
        return;
    }
    sender->heard = shared_->clock.now();
    sender->pipeline->take(std::move(*adu));
    answer(from);
}

Datagrams::Peer* Datagrams::peer(const Endpoint& from) {
    if (const auto known = peers_.find(from); known != peers_.end()) return &known->second;
    const std::string address = from.address().to_string();
    const std::uint64_t host = host_number(address);
    if (!make_room(host)) return nullptr;
    std::string name = endpoint_text(address, from.port()) + " udp";
    WhoRef who = make_who({.face = Face::udp,
                           .name = "modbus_tcp " + name,
                           .address = address,
                           .listener = shared_->settings.name(),
                           .standing = Role::operator_});
    const auto on_answer = [weak = weak_from_this(), from] {
        if (const auto self = weak.lock()) self->answer(from);
    };
    Peer made{host, std::make_shared<Pipeline>(shared_, Caller(std::move(name), std::move(who)),
                                               on_answer)};
    return &peers_.emplace(from, std::move(made)).first->second;
}

/// A source address may be forged, so an address has few peers, at most half of all, and only an
/// idle peer gives way: the requests of a busy one have been accepted (P3).
bool Datagrams::make_room(std::uint64_t host) {
    const std::size_t most = shared_->settings.max_connections;
    std::vector<Guest> guests;
    for (const auto& [from, peer] : peers_)
        guests.push_back({peer.host, peer.pipeline->empty(), peer.heard});
    const Place place = find_place(
        guests, host, {most, std::min(shared_->settings.udp_peers_per_address, (most + 1) / 2)});
    if (!place.taken_from) return place.found;
    if (!guests[*place.taken_from].idle) return false;
    const auto gives_way =
        std::next(peers_.begin(), static_cast<std::ptrdiff_t>(*place.taken_from));
    gives_way->second.pipeline->close();
    peers_.erase(gives_way);
    return true;
}

void Datagrams::answer(const Endpoint& to) {
    const auto found = peers_.find(to);
    if (found == peers_.end() || !socket_.is_open()) return;
    const std::shared_ptr<Pipeline> pipeline = found->second.pipeline;
    error_code ignored;
    for (; const Bytes* adu = pipeline->front(); pipeline->pop())
        socket_.send_to(asio::buffer(*adu), to, 0,
                        ignored);  // what the system does not take is lost
    if (on_answer_) on_answer_();
}

bool Datagrams::idle() const {
    return std::ranges::all_of(peers_,
                               [](const auto& peer) { return peer.second.pipeline->empty(); });
}

void Datagrams::finish(std::function<void()> on_answer) {
    on_answer_ = std::move(on_answer);
    const auto peers = peers_;  // on_answer may end them
    for (const auto& [endpoint, peer] : peers) {
        peer.pipeline->refuse_waiting();
        answer(endpoint);
    }
}

void Datagrams::close() {
    error_code ignored;
    socket_.close(ignored);
    for (auto& [endpoint, peer] : std::exchange(peers_, {})) peer.pipeline->close();
}

}  // namespace panelgate::tcp_server
