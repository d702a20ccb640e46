#include "panelgate/gateway/alarm_hook.hpp"

#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/base/network.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/client.hpp"

namespace panelgate::gateway {

namespace {

constexpr Duration kHookPatience = 10s;
constexpr std::size_t kHookReply = 4096;  // bytes of an answer that are read

bool has_status(const web::HttpReply& reply) {
    return reply.text.find("\r\n") != std::string::npos;
}

/// Whom an https server must be known by: the CA's file, read for each post.
std::optional<tls::Trust> trust_of(const alarms::Url& url, const std::string& ca) {
    if (!url.secure) return std::nullopt;
    std::ifstream in(ca);
    return tls::Trust{{}, {std::istreambuf_iterator<char>(in), {}}};
}

/// Posts JSON. Returns why the server has not taken the request; "" if it has.
std::string post(const alarms::Url& url, const std::string& ca, const std::string& body) {
    const std::string request =
        "POST " + url.path + " HTTP/1.1\r\nHost: " + endpoint_text(url.host, url.port) +
        "\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
        "\r\nConnection: close\r\n\r\n" + body;
    const web::HttpReply reply = web::ask({url.host, url.port, trust_of(url, ca)}, request,
                                          kHookPatience, kHookReply, has_status);
    if (!has_status(reply)) return reply.failure();
    return reply.is_http() && reply.status().starts_with('2') ? "" : reply.status();
}

}  // namespace

AlarmHook::AlarmHook(boost::asio::any_io_executor executor, rt::Clock& clock)
    : clock_(clock), alarm_(clock.make_alarm()), executor_(std::move(executor)) {}

bool AlarmHook::apply(const std::optional<alarms::WebhookSettings>& settings) {
    if (hook_ && settings && hook_->settings().format == settings->format) {
        hook_->apply(*settings);
        return false;
    }
    hook_.reset();
    alarm_->cancel();
    if (!settings) return false;
    hook_.emplace(*settings);
    if (!worker_) worker_ = std::make_unique<rt::Worker>(executor_);
    return true;
}

void AlarmHook::stop() {
    alarm_->cancel();
    hook_.reset();
}

void AlarmHook::on_change(const alarms::Change& change) {
    if (!hook_) return;
    hook_->on_change(change);
    look();
}

/// Sends what is due, or waits for it.
void AlarmHook::look() {
    if (!hook_ || under_way_) return;
    if (auto body = hook_->next(clock_.now())) return send(std::move(*body));
    if (const auto due = hook_->due()) alarm_->arm(*due, [this] { look(); });
}

void AlarmHook::send(std::string body) {
    under_way_ = true;
    const auto why = std::make_shared<std::string>();
    const alarms::Url url = alarms::parse_url(hook_->settings().url).value();
    worker_->run([url, ca = hook_->settings().ca, body = std::move(body),
                  why] { *why = post(url, ca, body); },
                 [this, why, life = std::weak_ptr(alive_)] {
                     if (!life.expired()) settle(*why);
                 });
}

void AlarmHook::settle(const std::string& why) {
    under_way_ = false;
    if (!hook_) return;
    if (!why.empty() && !std::exchange(failing_, true))
        rt::log(rt::LogLevel::warn, "webhook fails",
                {{"url", hook_->settings().url}, {"why", why}});
    if (why.empty() && std::exchange(failing_, false))
        rt::log(rt::LogLevel::info, "webhook answers", {{"url", hook_->settings().url}});
    hook_->settle(clock_.now(), why.empty());
    look();
}

}  // namespace panelgate::gateway
