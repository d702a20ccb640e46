#include "panelgate/web/http/listener.hpp"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "origin.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/handshakes.hpp"
#include "panelgate/tls/peer.hpp"
#include "router.hpp"
#include "session.hpp"
#include "shared.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

std::shared_ptr<tls::Handshakes> handshakes_of(const asio::any_io_executor& executor,
                                               const Settings& settings) {
    if (!settings.tls) return nullptr;
    return std::make_shared<tls::Handshakes>(executor, "http " + settings.name(), *settings.tls);
}

}  // namespace

HttpListener::HttpListener(asio::any_io_executor executor, std::shared_ptr<const Site> site)
    : shared_(std::make_shared<Shared>(std::move(site))),
      allowed_(shared_->site->settings.allow),
      handshakes_(handshakes_of(executor, shared_->site->settings)),
      acceptor_(
          executor, [this](tcp::socket socket) { take(std::move(socket)); },
          [this](const error_code& why) {
              rt::log(rt::LogLevel::warn, "cannot accept",
                      {{"listener", shared_->site->settings.name()}, {"reason", why.message()}});
          }) {}

error_code HttpListener::open() {
    const Settings& settings = shared_->site->settings;
    shared_->figures = [self = weak_from_this()] {
        const auto listener = self.lock();
        return listener ? listener->counters() : Counters();
    };
    return acceptor_.open(settings.address, settings.port, settings.ipv6_only);
}

namespace {

/// True if what the caller has shown means the same as before.
bool has_same_right(const Caller& caller, const Settings& before, const Settings& now) {
    if (caller.token().empty()) return before.anonymous == now.anonymous;
    const auto in = [&](const Settings& settings) {
        return std::ranges::find(settings.tokens, caller.token(), &Token::name);
    };
    const auto was = in(before);
    const auto is = in(now);
    return was != before.tokens.end() && is != now.tokens.end() && was->hash == is->hash &&
           was->standing == is->standing;
}

}  // namespace

void HttpListener::apply(std::shared_ptr<const Site> site) {
    allowed_ = rt::AccessList(site->settings.allow);
    const std::shared_ptr<const Site> before = shared_->site;
    if (handshakes_ && site->settings.tls) handshakes_->apply(*site->settings.tls);
    shared_->serve(std::move(site));
    const auto sessions = sessions_;
    for (const auto& [id, session] : sessions) {
        if (!allowed_.allows(session->peer())) {
            session->stop(shared_->site->settings.request_timeout);
            continue;
        }
        const Settings& now = shared_->site->settings;
        const bool may_read = session->reader().empty() || is_listed(session->reader(), now.cors);
        if (!may_read || !has_same_right(session->caller(), before->settings, now))
            session->end_events();
    }
    if (handshakes_) apply_roles(before->settings);
    review();
}

namespace {

void dismiss(const std::string& listener, HttpSession& session, const std::string& why,
             Duration patience) {
    rt::log(rt::LogLevel::warn, "connection closed",
            {{"listener", listener}, {"client", session.caller().name()}, {"reason", why}});
    session.stop(patience);
}

}  // namespace

void HttpListener::apply_roles(const Settings& before) {
    const Settings& now = shared_->site->settings;
    const Standing& anonymous = now.anonymous;
    const Standing least = only_reading(anonymous);
    const auto sessions = sessions_;
    for (const auto& [id, session] : sessions) {
        const tls::Peer& peer = session->stream().peer();
        if (!peer.shown) continue;  // as anonymous as before
        const std::string why = tls::why_other_role(before.tls, now.tls, peer, anonymous, least);
        if (why.empty())
            session->take_certificate();
        else
            dismiss(now.name(), *session, why, now.request_timeout);
    }
}

/// Running requests are answered, such as the one that has asked for the new rules.
void HttpListener::review() {
    if (!handshakes_) return;
    const Settings& settings = shared_->site->settings;
    const auto sessions = sessions_;
    for (const auto& [id, session] : sessions) {
        const std::string why = handshakes_->why_leave(session->stream());
        if (!why.empty()) dismiss(settings.name(), *session, why, settings.request_timeout);
    }
}

void HttpListener::renew(const tls::Settings& settings) {
    if (!handshakes_) return;
    handshakes_->apply(settings);
    review();
}

Counters HttpListener::counters() const {
    Counters counters = shared_->counters;
    counters.listener = shared_->site->settings.name();
    if (handshakes_) counters.tls = handshakes_->counters();
    return counters;
}

std::uint16_t HttpListener::port() const { return acceptor_.port(); }

void HttpListener::take(tcp::socket socket) {
    error_code gone;
    const tcp::endpoint peer = socket.remote_endpoint(gone);
    if (gone) return;
    if (!allowed_.allows(peer.address())) {
        rt::log(rt::LogLevel::info, "connection refused",
                {{"listener", shared_->site->settings.name()},
                 {"client", peer.address().to_string()},
                 {"reason", "not in the allow list"}});
        return;
    }
    if (!handshakes_) return serve(tls::Stream(std::move(socket)));
    handshakes_->begin(std::move(socket), [weak = weak_from_this()](tls::Stream stream) {
        if (const auto self = weak.lock()) self->serve(std::move(stream));
    });
}

/// `allow` may have changed during the handshake.
void HttpListener::serve(tls::Stream stream) {
    error_code gone;
    const tcp::endpoint peer = stream.socket().remote_endpoint(gone);
    if (gone || !allowed_.allows(peer.address())) return;
    const auto caller =
        std::make_shared<Caller>(shared_->site->next_caller(), peer.address().to_string());
    const bool probes_only = make_room(*caller);
    auto session = std::make_shared<HttpSession>(std::move(stream), shared_, caller, probes_only);
    sessions_.emplace(caller->id(), session);
    open_ = sessions_.size();
    asio::co_spawn(
        acceptor_.get_executor(), HttpSession::run(session),
        [self = weak_from_this(), session, id = caller->id()](std::exception_ptr failed) {
            if (failed) rt::log(rt::LogLevel::error, "http session failed");
            session->abandon();
            const auto listener = self.lock();
            if (!listener) return;
            listener->shared_->places.leave(id);
            listener->sessions_.erase(id);
            listener->open_ = listener->sessions_.size();
        });
}

bool HttpListener::make_room(const Caller& caller) {
    const Places::Arrival arrival = shared_->places.arrive(caller.id(), caller.host());
    if (arrival.probes_only) {
        rt::log(rt::LogLevel::warn, "http requests refused",
                {{"listener", shared_->site->settings.name()},
                 {"client", caller.address()},
                 {"reason", "all places are taken"}});
    }
    if (arrival.leaves) {
        const auto displaced = sessions_.find(*arrival.leaves);
        if (displaced != sessions_.end()) std::shared_ptr(displaced->second)->abandon();
    }
    return arrival.probes_only;
}

void HttpListener::stop(Duration reading) {
    acceptor_.close();
    if (handshakes_) handshakes_->stop();
    const auto sessions = sessions_;
    for (const auto& [id, session] : sessions) session->stop(reading);
}

void HttpListener::abandon() {
    stop(Duration::zero());
    const auto sessions = sessions_;
    for (const auto& [id, session] : sessions) session->abandon();
}

}  // namespace panelgate::web
