#include "panelgate/gateway/broker_desk.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <functional>
#include <utility>
#include <variant>

#include "panelgate/gateway/northbound.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

namespace {

constexpr Duration kRebirth = 1s;  ///< minimum interval: hosts may ask as often as they like
constexpr Duration kKeep = 1s;
constexpr Duration kLook = 5ms;         ///< how often the end of the farewell is looked for
constexpr std::size_t kRefusals = 256;  ///< on their way to the session, for the audit

}  // namespace

std::string answer_text(bool ok, const boost::json::object& members) {
    boost::json::object body{{"ok", ok}};
    for (const auto& [name, value] : members) body[name] = value;
    return web::json_text(body);
}

BrokerDesk::BrokerDesk(web::Loops loops, const mqtt::Settings& settings, mqtt::Subjects subjects)
    : loops_(std::move(loops)),
      clock_(loops_.faces),
      settings_(settings),
      publisher_(settings, std::move(subjects)),
      alarm_(clock_.make_alarm()),
      keeping_(clock_.make_alarm()),
      client_(loops_.faces, clock_, settings, publisher_,
              [this](const mqtt::Command& command) { on_command(command); }) {}

void BrokerDesk::start(std::weak_ptr<BrokerSession> session) {
    session_ = std::move(session);
    client_.start();
    keep_waiting();
}

void BrokerDesk::restore(const mqtt::Outbox::Texts& kept) {
    outbox_.emplace().restore(publisher_, kept);
}

/// Has the session keep what waits for the broker, once a second.
void BrokerDesk::keep_waiting() {
    if (!outbox_) return;
    mqtt::Outbox::Texts texts = outbox_->next(publisher_);
    if (!texts.empty())
        tell([texts = std::move(texts)](BrokerSession& session) { session.keep(texts); });
    keeping_->arm(clock_.now() + kKeep, [this] { keep_waiting(); });
}

void BrokerDesk::stop(const std::shared_ptr<std::atomic<bool>>& closed) {
    alarm_->cancel();
    keep_waiting();
    keeping_->cancel();
    closing_ = client_.stop();
    wait_for(closed);
}

void BrokerDesk::wait_for(const std::shared_ptr<std::atomic<bool>>& closed) {
    if (!closing_ || closing_->done()) {
        closing_.reset();
        *closed = true;
        return;
    }
    alarm_->arm(clock_.now() + kLook, [this, closed] { wait_for(closed); });
}

void BrokerDesk::take_over(BrokerDesk& before) {
    publisher_.take_over(before.publisher_);
    outbox_ = std::exchange(before.outbox_, std::nullopt);
    counters_ = before.counters();
    if (settings_.broker() == before.settings_.broker()) under_way_ = before.under_way_;
}

void BrokerDesk::offer(std::size_t subject, mqtt::State state, bool again) {
    if (publisher_.offer(subject, std::move(state), again)) client_.wake();
}

void BrokerDesk::repeat(std::size_t subject) { publisher_.repeat(subject); }

void BrokerDesk::end_write() { under_way_ -= std::min<std::size_t>(under_way_, 1); }

void BrokerDesk::answer(const std::string& topic, const std::string& id, const std::string& body,
                        bool ok) {
    end_write();
    ++(ok ? counters_.writes_ok : counters_.writes_failed);
    publisher_.answer({topic, id, body}, false);
    client_.wake();
}

void BrokerDesk::answer_refused(const std::string& topic, const std::string& id,
                                const web::Problem& why) {
    end_write();
    refuse(topic, id, why);
}

void BrokerDesk::refuse(const std::string& topic, const std::string& id, const web::Problem& why) {
    ++counters_.writes_refused;
    rt::log(rt::LogLevel::warn, "mqtt write refused",
            {{"client", "mqtt"}, {"topic", web::excerpt(topic)}, {"why", why.detail}});
    publisher_.answer({topic, id, answer_text(false, web::json_of(why))}, true);
    client_.wake();
}

mqtt::Counters BrokerDesk::counters() const {
    mqtt::Counters all = client_.counters();
    all.published += counters_.published;
    all.dropped += counters_.dropped;
    all.results_dropped += counters_.results_dropped;
    all.reconnects += counters_.reconnects;
    all.writes_ok = counters_.writes_ok;
    all.writes_refused += counters_.writes_refused;
    all.writes_failed = counters_.writes_failed;
    all.broker = settings_.broker();
    return all;
}

void BrokerDesk::tell(std::function<void(BrokerSession&)> work) {
    boost::asio::post(loops_.plant, [session = session_, work = std::move(work)] {
        if (const auto alive = session.lock()) work(*alive);
    });
}

void BrokerDesk::on_command(const mqtt::Command& command) {
    if (std::holds_alternative<mqtt::Rebirth>(command)) {
        if (std::exchange(rebirth_waits_, true)) return;
        return alarm_->arm(std::max(clock_.now(), next_rebirth_), [this] { on_rebirth(); });
    }
    if (const auto* bad = std::get_if<mqtt::BadCommand>(&command))
        return refuse_here(bad->topic, bad->id, web::problem(400, bad->why), {});
    const auto& write = std::get<mqtt::WriteCommand>(command);
    const std::string topic = publisher_.topic_of(write.point);
    if (under_way_ >= settings_.writes)
        return refuse_here(topic, write.id, web::problem(503, "too many writes are under way"),
                           write.point);
    if (!publisher_.has_room_for_answer(under_way_))
        return refuse_here(topic, write.id,
                           web::problem(503, "too many answers wait for the broker"), write.point);
    ++under_way_;
    tell([write, topic](BrokerSession& session) { session.write(write, topic); });
}

void BrokerDesk::on_rebirth() {
    rebirth_waits_ = false;
    next_rebirth_ = clock_.now() + kRebirth;
    publisher_.rebirth();
    client_.wake();
}

/// Answers at once; the session gets the refusal for the audit, if not too many are on their way.
void BrokerDesk::refuse_here(const std::string& topic, const std::string& id,
                             const web::Problem& why, std::optional<std::size_t> point) {
    refuse(topic, id, why);
    if (*told_ >= kRefusals) return;
    ++*told_;
    tell([told = told_, topic, why, point](BrokerSession& session) {
        --*told;
        session.refused(topic, why, point);
    });
}

}  // namespace panelgate::gateway
