#include "panelgate/tcp_server/listener.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cstddef>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "datagrams.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/tls/peer.hpp"
#include "places.hpp"
#include "session.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// CON-07: a dead peer is detected after 60 s of silence and 3 probes 10 s apart.
constexpr rt::KeepAlive kKeepAlive{60s, 10s, 3};
// Bounds what the kernel buffers for a client that does not read: by default megabytes, and each
// buffered reply arrives older than one requested later.
constexpr int kSendBuffer = 64 * 1024;
constexpr int kUnsentBytes = 4 * 1024;  // 16 of the longest replies

void set_option(tcp::socket& socket, int level, int name, int value) {
    ::setsockopt(socket.native_handle(), level, name, &value, sizeof value);
}

/// A failed option is no reason to refuse a client.
void set_up(tcp::socket& socket) {
    rt::set_up_socket(socket.native_handle(), kKeepAlive);
    set_option(socket, SOL_SOCKET, SO_SNDBUF, kSendBuffer);
    set_option(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, kUnsentBytes);
}

std::string text(const tcp::endpoint& peer) {
    return endpoint_text(peer.address().to_string(), peer.port());
}

std::shared_ptr<Shared> share(rt::Clock& clock, Settings settings, UnitMap units,
                              std::string version, StrayWrite stray) {
    auto own_answers =
        std::make_shared<OwnAnswers>(clock, settings.own_answers, settings.own_answers_period);
    return std::make_shared<Shared>(Shared{std::move(settings),
                                           std::move(units),
                                           std::move(version),
                                           clock,
                                           {},
                                           clock.now(),
                                           std::move(own_answers),
                                           {},
                                           std::move(stray)});
}

}  // namespace

class Listener::Core : public std::enable_shared_from_this<Core> {
  public:
    Core(const asio::any_io_executor& executor, rt::Clock& clock, Settings settings, UnitMap units,
         std::string version, StrayWrite stray)
        : shared_(share(clock, std::move(settings), std::move(units), std::move(version),
                        std::move(stray))),
          allowed_(shared_->settings.allow),
          acceptor_(
              executor, [this](tcp::socket socket) { on_accepted(std::move(socket)); },
              [this](const error_code& why) {
                  shared_->log(rt::LogLevel::warn, "cannot accept", {{"reason", why.message()}});
              }) {
        shared_->counters.listener = shared_->settings.name();
        if (shared_->settings.tls)
            shared_->handshakes = std::make_shared<tls::Handshakes>(
                executor, "modbus_tcp " + shared_->settings.name(), *shared_->settings.tls);
        if (shared_->settings.udp) datagrams_ = std::make_shared<Datagrams>(executor, shared_);
    }

    void start();
    void apply(Settings settings, UnitMap units);
    void renew(const tls::Settings& settings);
    void review();
    std::uint16_t port() const { return acceptor_.port(); }
    Counters counters() const;
    void stop(std::function<void()> done);
    void close_now();

  private:
    void on_accepted(tcp::socket socket);
    void on_secured(tls::Stream stream);
    void admit(tls::Stream stream, const tcp::endpoint& peer);
    bool make_room(const tcp::endpoint& peer);
    void evict(Session& victim, bool idle, const tcp::endpoint& peer);
    void count_refused(const tcp::endpoint& peer, const Place& place);
    void on_closed(const std::shared_ptr<Session>& session);
    void apply_roles(const Settings& before);
    void notify_when_empty();

    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    rt::Acceptor acceptor_;
    std::shared_ptr<Datagrams> datagrams_;  ///< null without settings.udp
    std::set<std::shared_ptr<Session>> sessions_;
    std::function<void()> done_;
    bool full_ = false;  ///< already logged
};

void Listener::Core::start() {
    const Settings& settings = shared_->settings;
    const error_code error = acceptor_.open(settings.address, settings.port, settings.ipv6_only);
    if (error) throw std::system_error(error, "cannot listen on " + settings.name());
    if (!datagrams_) return;
    const error_code of_udp =
        datagrams_->open(settings.address, acceptor_.port(), settings.ipv6_only);
    if (!of_udp) return;
    acceptor_.close();
    throw std::system_error(of_udp, "cannot receive datagrams on " + settings.name());
}

void Listener::Core::apply(Settings settings, UnitMap units) {
    allowed_ = rt::AccessList(settings.allow);
    if (datagrams_) datagrams_->allow(allowed_);
    if (shared_->handshakes && settings.tls) shared_->handshakes->apply(*settings.tls);
    const Settings before = std::exchange(shared_->settings, std::move(settings));
    shared_->units = std::move(units);
    const std::set<std::shared_ptr<Session>> sessions = sessions_;  // close() erases
    for (const auto& session : sessions) {
        if (!allowed_.allows(session->peer())) session->close();
    }
    if (shared_->handshakes) apply_roles(before);
    review();
}

void Listener::Core::renew(const tls::Settings& settings) {
    if (!shared_->handshakes) return;
    shared_->handshakes->apply(settings);
    shared_->settings.tls = settings;
    review();
}

/// Without roles from certificates everybody writes.
void Listener::Core::apply_roles(const Settings& before) {
    const std::set<std::shared_ptr<Session>> sessions = sessions_;  // dismiss() erases
    for (const auto& session : sessions) {
        if (!session->stream().is_secure()) continue;
        const std::string why = tls::why_other_role(
            before.tls, shared_->settings.tls, session->stream().peer(), {Role::operator_}, {});
        if (!why.empty()) session->dismiss(why);
    }
}

void Listener::Core::review() {
    if (!shared_->handshakes) return;
    const std::set<std::shared_ptr<Session>> sessions = sessions_;  // dismiss() erases
    for (const auto& session : sessions) {
        const std::string why = shared_->handshakes->why_leave(session->stream());
        if (!why.empty()) session->dismiss(why);
    }
}

Counters Listener::Core::counters() const {
    Counters counters = shared_->counters;
    counters.connections = sessions_.size();
    if (shared_->handshakes) counters.tls = shared_->handshakes->counters();
    return counters;
}

void Listener::Core::on_accepted(tcp::socket socket) {
    ++shared_->counters.connections_total;
    error_code gone;
    const tcp::endpoint peer = socket.remote_endpoint(gone);
    if (gone) return;
    if (!allowed_.allows(peer.address())) {
        shared_->log(rt::LogLevel::info, "connection refused",
                     {{"client", text(peer)}, {"reason", "not in the allow list"}});
    } else if (shared_->handshakes) {
        set_up(socket);
        shared_->handshakes->begin(std::move(socket),
                                   [weak = weak_from_this()](tls::Stream stream) {
                                       if (const auto self = weak.lock())
                                           self->on_secured(std::move(stream));
                                   });
    } else if (make_room(peer)) {
        set_up(socket);
        admit(tls::Stream(std::move(socket)), peer);
    }
}

/// `allow` may have changed during the handshake.
void Listener::Core::on_secured(tls::Stream stream) {
    error_code gone;
    const tcp::endpoint peer = stream.socket().remote_endpoint(gone);
    if (!gone && !done_ && allowed_.allows(peer.address()) && make_room(peer))
        admit(std::move(stream), peer);
}

/// Beyond a limit a connection gives way to the newcomer, or the newcomer is refused (P9). Nobody
/// gives way to one who has not shown by a TLS handshake who he is; handshakes have limits of their
/// own.
bool Listener::Core::make_room(const tcp::endpoint& peer) {
    std::vector<Guest> guests;
    std::vector<std::shared_ptr<Session>> seated;
    guests.reserve(sessions_.size());
    seated.reserve(sessions_.size());
    for (const auto& session : sessions_) {
        guests.push_back(session->guest());
        seated.push_back(session);
    }
    const Settings& settings = shared_->settings;
    const PlaceLimits limits{settings.max_connections, settings.max_connections_per_address};
    const Place place = find_place(guests, host_number(peer.address().to_string()), limits);
    if (!place.found) {
        ++shared_->counters.refused;
        count_refused(peer, place);
    } else if (place.taken_from) {
        evict(*seated[*place.taken_from], guests[*place.taken_from].idle, peer);
    }
    return place.found;
}

/// Closes one of sessions_ for a newcomer. A busy one leaves requests without an answer, which an
/// operator should know.
void Listener::Core::evict(Session& victim, bool idle, const tcp::endpoint& peer) {
    const rt::LogLevel level = idle ? rt::LogLevel::info : rt::LogLevel::warn;
    const char* reason = idle ? "the longest idle one" : "its address has the most, all busy";
    ++shared_->counters.evicted;
    shared_->log(level, "connection gives way",
                 {{"client", victim.client()}, {"reason", reason}, {"to", text(peer)}});
    victim.close();
}

/// Logs once until a connection closes.
void Listener::Core::count_refused(const tcp::endpoint& peer, const Place& place) {
    if (std::exchange(full_, true)) return;
    const std::string key = place.share_used ? "max_connections_per_address" : "max_connections";
    shared_->log(rt::LogLevel::warn, "connections refused",
                 {{"client", text(peer)},
                  {"reason", key + " reached"},
                  {"open", std::to_string(sessions_.size())},
                  {"of_its_address", std::to_string(place.own)}});
}

void Listener::Core::admit(tls::Stream stream, const tcp::endpoint& peer) {
    const auto session = std::make_shared<Session>(
        std::move(stream), shared_,
        [weak = weak_from_this()](const std::shared_ptr<Session>& closed) {
            if (const auto self = weak.lock()) self->on_closed(closed);
        });
    sessions_.insert(session);
    WhoRef who = make_who({.face = Face::modbus_tcp,
                           .name = "modbus_tcp " + text(peer),
                           .address = peer.address().to_string(),
                           .listener = shared_->settings.name(),
                           .standing = Role::operator_});
    session->start(Caller(text(peer), std::move(who)));
}

void Listener::Core::on_closed(const std::shared_ptr<Session>& session) {
    sessions_.erase(session);
    if (std::exchange(full_, false)) shared_->log(rt::LogLevel::info, "connections accepted again");
    notify_when_empty();
}

void Listener::Core::notify_when_empty() {
    if (!done_ || !sessions_.empty() || (datagrams_ && !datagrams_->idle())) return;
    asio::post(acceptor_.get_executor(), std::exchange(done_, nullptr));
}

void Listener::Core::stop(std::function<void()> done) {
    acceptor_.close();
    done_ = std::move(done);
    if (shared_->handshakes) shared_->handshakes->stop();
    const std::set<std::shared_ptr<Session>> sessions = sessions_;  // finish() may erase
    for (const auto& session : sessions) session->finish();
    if (datagrams_) datagrams_->finish([this] { notify_when_empty(); });
    notify_when_empty();
}

void Listener::Core::close_now() {
    acceptor_.close();
    if (shared_->handshakes) shared_->handshakes->stop();
    const std::set<std::shared_ptr<Session>> sessions = sessions_;  // close() erases
    for (const auto& session : sessions) session->close();
    if (datagrams_) datagrams_->close();
    notify_when_empty();
}

Listener::Listener(const asio::any_io_executor& executor, rt::Clock& clock, Settings settings,
                   UnitMap units, std::string version, StrayWrite stray)
    : core_(std::make_shared<Core>(executor, clock, std::move(settings), std::move(units),
                                   std::move(version), std::move(stray))) {}

Listener::~Listener() { core_->close_now(); }

void Listener::start() { core_->start(); }
void Listener::apply(Settings settings, UnitMap units) {
    core_->apply(std::move(settings), std::move(units));
}
void Listener::renew(const tls::Settings& settings) { core_->renew(settings); }
void Listener::review() { core_->review(); }
std::uint16_t Listener::port() const { return core_->port(); }
Counters Listener::counters() const { return core_->counters(); }
void Listener::stop(std::function<void()> done) { core_->stop(std::move(done)); }
void Listener::close_now() { core_->close_now(); }

}  // namespace panelgate::tcp_server
