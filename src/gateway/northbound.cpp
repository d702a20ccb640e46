#include "panelgate/gateway/northbound.hpp"

#include <algorithm>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/post.hpp>
#include <utility>
#include <variant>

#include "panelgate/alarms/webhook.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/tls/judge.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::gateway {

namespace {

constexpr std::size_t kSwept = 500;  ///< subjects per turn: well below a millisecond
constexpr Duration kSweep = 1s;

mqtt::Settings completed(mqtt::Settings settings) {
    std::string host = boost::asio::ip::host_name();
    if (settings.client_id.empty()) settings.client_id = "panelgate-" + host;
    if (settings.node.empty()) settings.node = std::move(host);
    if (settings.group.empty()) {
        settings.group = settings.topic;
        std::ranges::replace(settings.group, '/', '-');
    }
    return settings;
}

}  // namespace

/// A write that was passed to its bus.
struct BrokerSession::Order {
    std::string station;
    std::string point;
    std::string topic;  ///< the topic of the command
    std::string id;
    profile::ProfileRef profile;
    web::PointOrder order;
};

BrokerSession::BrokerSession(web::Loops loops, rt::Clock& clock, Journal& journal,
                             const std::shared_ptr<const Snapshot>& snapshot, TopicRefusals refused,
                             std::shared_ptr<std::weak_ptr<BrokerDesk>> serving)
    : loops_(std::move(loops)),
      clock_(clock),
      journal_(journal),
      settings_(completed(*snapshot->config->mqtt)),
      subjects_(explain::subjects_of(*snapshot->config)),
      alarm_(clock.make_alarm()),
      refused_(std::move(refused)),
      who_(explain::client_of(settings_)),
      writes_(std::make_shared<Writes>(Writes{this, bus::next_client_id()})),
      desk_(std::make_shared<BrokerDesk>(loops_, settings_, subjects_)),
      serving_(std::move(serving)) {
    show(snapshot);
}

/// The desk ends in the loop of the faces, after the messages that are on their way to the desk.
BrokerSession::~BrokerSession() {
    boost::asio::post(loops_.faces, [desk = std::move(desk_)] {});
}

void BrokerSession::at_desk(std::function<void(BrokerDesk&)> work) const {
    ++desk_->waiting;
    boost::asio::post(loops_.faces, [desk = desk_, work = std::move(work)] {
        --desk->waiting;
        work(*desk);
    });
}

bool BrokerSession::fits(const Snapshot& snapshot) const {
    const auto& mqtt = snapshot.config->mqtt;
    return mqtt && completed(*mqtt) == settings_ &&
           explain::subjects_of(*snapshot.config) == subjects_;
}

void BrokerSession::show(std::shared_ptr<const Snapshot> snapshot) {
    snapshot_ = std::move(snapshot);
    numbers_.clear();
    told_.clear();
    renew(snapshot_->config->mqtt->files);
    const explain::BrokerSight sight(*snapshot_->config);
    const auto lines = std::ranges::count_if(
        snapshot_->config->lines, [&](const config::Line& line) { return sight.line(line); });
    places_.assign(static_cast<std::size_t>(lines), {});
    for (const Station* station : explain::by_name(snapshot_->plant.stations())) {
        if (!sight.station(*station->configured)) continue;
        Numbers& numbers = numbers_[station];
        numbers.station = places_.size();
        places_.push_back({station, nullptr});
        if (!station->points) continue;
        const std::vector<points::Point>& points = station->points->points();
        numbers.points.assign(points.size(), numbers.station);
        for (const points::Point* point : explain::by_name(points)) {
            if (!sight.point(*station->configured, *point)) continue;
            numbers.points[static_cast<std::size_t>(point - points.data())] = places_.size();
            places_.push_back({station, point});
        }
    }
}

void BrokerSession::renew(const tls::Material& files) {
    settings_.files = mqtt::Files{files};
    counters_.certificate_expiry = tls::summary_of(files.certificate).end;
    at_desk([files](BrokerDesk& desk) { desk.renew(files); });
}

void BrokerSession::take_over(BrokerSession& before) {
    at_desk([former = before.desk_](BrokerDesk& desk) { desk.take_over(*former); });
    const std::int64_t expiry = counters_.certificate_expiry;
    counters_ = before.counters_;
    counters_.certificate_expiry = expiry;
    if (settings_.broker() != before.settings_.broker())
        return;  // the clients of those writes are at the other broker
    writes_ = std::move(before.writes_);
    writes_->session = this;
}

void BrokerSession::restore(const mqtt::Outbox::Texts& kept) {
    at_desk([kept](BrokerDesk& desk) { desk.restore(kept); });
}

void BrokerSession::keep(const mqtt::Outbox::Texts& texts) {
    for (const auto& [key, text] : texts) journal_.keep(key, text);
}

void BrokerSession::start() {
    is_started_ = true;
    for (auto& [subject, state] : std::exchange(early_, {}))
        at_desk([subject, state](BrokerDesk& desk) { desk.know(subject, state); });
    for (std::size_t i = 0; i < places_.size(); ++i)
        if (auto state = seen(i))
            at_desk([i, state = std::move(*state)](BrokerDesk& desk) { desk.know(i, state); });
    at_desk([self = weak_from_this(), serving = serving_,
             own = std::weak_ptr(desk_)](BrokerDesk& desk) {
        desk.start(self);
        *serving = own;
    });
    sweep();
}

void BrokerSession::stop() {
    if (closed_) return;
    closed_ = std::make_shared<std::atomic<bool>>(false);
    alarm_->cancel();
    at_desk([closed = closed_](BrokerDesk& desk) { desk.stop(closed); });
    if (writes_) {
        for (const Place& place : places_)
            if (place.station != nullptr && place.point == nullptr)
                place.station->bus->cancel(writes_->client);
    }
    writes_.reset();
    places_.clear();
    numbers_.clear();
    snapshot_.reset();  // the lines of an earlier configuration end
}

mqtt::State BrokerSession::state_of(const points::PointReading& reading) const {
    mqtt::State state;
    state.value = reading.value;
    state.text = reading.label.value_or("");
    state.quality = reading.quality;
    state.time = rt::wall_now();
    if (reading.value && reading.age) {
        const TimePoint now = clock_.now();
        state.time = wall_time_of(now - *reading.age, now, state.time);
    }
    return state;
}

/// The current state of a subject; nothing for lines, which report by on_bus_event().
std::optional<mqtt::State> BrokerSession::seen(std::size_t subject) const {
    const Place& place = places_[subject];
    if (place.station == nullptr) return std::nullopt;
    if (place.point != nullptr)
        return state_of(place.station->points->read(*place.point, clock_.now()));
    const Health health = place.station->bus->station_status(place.station->id).state;
    mqtt::State state;
    state.value = health != Health::offline && health != Health::unknown;
    state.text = label(health);
    state.time = rt::wall_now();
    return state;
}

void BrokerSession::look(std::size_t subject) {
    if (!is_started_ || !desk_->has_room()) return;
    const Place& place = places_[subject];
    if (place.point != nullptr && !place.point->report.empty()) return look_by_rule(subject, place);
    auto state = seen(subject);
    if (!state) return;
    at_desk([subject, state = std::move(*state)](BrokerDesk& desk) { desk.offer(subject, state); });
}

void BrokerSession::look_by_rule(std::size_t subject, const Place& place) {
    const TimePoint now = clock_.now();
    const points::PointReading reading = place.station->points->read(*place.point, now);
    const points::Report report = told_[subject].take(place.point->report, reading, now);
    if (report == points::Report::none) return;
    at_desk([subject, state = state_of(reading), report](BrokerDesk& desk) {
        desk.offer(subject, state, report == points::Report::again);
    });
}

/// The stations of a line, or one of them.
void BrokerSession::look_at_stations(const std::string& line, std::optional<std::uint8_t> id) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
        const Place& place = places_[i];
        if (place.station != nullptr && place.point == nullptr && place.station->line == line &&
            (!id || place.station->id == *id))
            look(i);
    }
}

/// Publishes what becomes stale or bad by time alone, a part of the plant per turn.
void BrokerSession::sweep() {
    const std::size_t pieces = (places_.size() + kSwept - 1) / kSwept;
    for (std::size_t i = 0; i < kSwept && i < places_.size(); ++i) {
        look(swept_);
        swept_ = (swept_ + 1) % places_.size();
    }
    const auto share = static_cast<std::int64_t>(std::max<std::size_t>(pieces, 1));
    alarm_->arm(clock_.now() + std::max<Duration>(kSweep / share, 20ms), [this] { sweep(); });
}

void BrokerSession::keep(mqtt::Counters counters) {
    counters.certificate_expiry = counters_.certificate_expiry;
    counters_ = std::move(counters);
}

void BrokerSession::on_alarm(const std::string& name, mqtt::State state) {
    const auto subject = subjects_.find_alarm(name);
    if (!subject || !is_started_ || !desk_->has_room()) return;
    at_desk([subject = *subject, state = std::move(state)](BrokerDesk& desk) {
        desk.offer(subject, state);
    });
}

void BrokerSession::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    if (const auto* of_station = std::get_if<arbiter::StationEvent>(&event))
        look_at_stations(line, of_station->station);
    const auto* of_line = std::get_if<bus::LineEvent>(&event);
    const auto subject = subjects_.find_line(line);
    if (of_line == nullptr || !subject || (of_line->up && !of_line->why.empty())) return;
    mqtt::State state;
    state.value = of_line->up;
    state.text = of_line->up ? "up" : "down: " + of_line->why;
    state.time = rt::wall_now();
    if (!is_started_) {
        early_[*subject] = std::move(state);
        return;
    }
    at_desk([subject = *subject, state](BrokerDesk& desk) { desk.offer(subject, state); });
    look_at_stations(line, {});  // they are unknown now
}

void BrokerSession::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    const auto numbers = numbers_.find(&station);
    if (numbers == numbers_.end() || !station.points) return;
    for (const std::size_t want : wants)
        if (want < numbers->second.points.size()) look(numbers->second.points[want]);
    look(numbers->second.station);  // it may have answered for the first time
}

void BrokerSession::refused(const std::string& topic, const web::Problem& why,
                            std::optional<std::size_t> point) {
    if (!refused_) return;
    const Place place = point && *point < places_.size() ? places_[*point] : Place{};
    refused_({who_, topic, why, place.station, place.point});
}

void BrokerSession::answer_refused(const std::string& topic, const std::string& id,
                                   const web::Problem& why) const {
    at_desk([topic, id, why](BrokerDesk& desk) { desk.answer_refused(topic, id, why); });
}

void BrokerSession::write(const mqtt::WriteCommand& command, const std::string& topic) {
    const Place place = command.point < places_.size() ? places_[command.point] : Place{};
    if (place.point == nullptr || !writes_)
        return answer_refused(topic, command.id, web::problem(503, "the configuration changes"));
    const Station& station = *place.station;
    const profile::ProfileRef profile = station.configured->profile;
    auto order = web::order_of(*station.bus, station.id, *profile, *place.point, command.value);
    if (!order) {
        at_desk([point = command.point](BrokerDesk& desk) { desk.repeat(point); });
        refused(topic, order.error(), command.point);
        return answer_refused(topic, command.id, order.error());
    }
    bus::Request request = order->request;
    request.client = writes_->client;
    request.who = who_;
    station.bus->name_client(writes_->client, "mqtt");
    auto made = std::make_shared<const Order>(
        Order{station.name, place.point->name, topic, command.id, profile, std::move(*order)});
    station.bus->transact(std::move(request), [writes = std::weak_ptr<Writes>(writes_),
                                               made = std::move(made)](const bus::Answer& answer) {
        if (const auto open = writes.lock()) open->session->finish(*made, answer);
    });
}

void BrokerSession::finish(const Order& order, const bus::Answer& answer) {
    const auto result = web::write_result(order.order, answer, *order.profile);
    const auto point = subjects_.find_point(order.station, order.point);
    if (!result && point) at_desk([point = *point](BrokerDesk& desk) { desk.repeat(point); });
    if (!result && answer.refusal) return answer_refused(order.topic, order.id, result.error());
    const bool ok = result.has_value();
    at_desk([topic = order.topic, id = order.id, ok,
             text = answer_text(ok, ok ? *result : web::json_of(result.error()))](
                BrokerDesk& desk) { desk.answer(topic, id, text, ok); });
}

Northbound::Northbound(web::Loops loops, rt::Clock& clock, Journal& journal, TopicRefusals refused)
    : loops_(std::move(loops)), clock_(clock), journal_(journal), refused_(std::move(refused)) {}

void Northbound::show(const std::shared_ptr<const Snapshot>& snapshot) {
    if (session_ && session_->fits(*snapshot)) return session_->show(snapshot);
    std::shared_ptr<BrokerSession> next;
    if (snapshot->config->mqtt)
        next =
            std::make_shared<BrokerSession>(loops_, clock_, journal_, snapshot, refused_, serving_);
    if (session_ && next) next->take_over(*session_);
    if (!session_ && next && running_ && !journal_.file().empty()) next->restore({});
    leave();
    session_ = std::move(next);
    if (session_ && running_) session_->start();
}

std::function<std::function<void()>()> Northbound::collector() const {
    return [serving = serving_]() -> std::function<void()> {
        const auto desk = serving->lock();
        if (!desk) return {};
        return [session = desk->session(), counters = desk->counters()] {
            if (const auto alive = session.lock()) alive->keep(counters);
        };
    };
}

void Northbound::renew(const tls::Material& files) {
    if (session_) session_->renew(files);
}

void Northbound::start(std::function<void()> started) {
    journal_.ask_kept(mqtt::Outbox::kPrefix,
                      [this, started = std::move(started),
                       life = std::weak_ptr(alive_)](const Journal::Texts& kept) {
                          if (life.expired() || stopped_) return;
                          running_ = true;
                          if (!session_) return;
                          if (!journal_.file().empty()) session_->restore(kept);
                          session_->start();
                          started();
                      });
}

void Northbound::stop() {
    running_ = false;
    stopped_ = true;
    leave();
}

void Northbound::leave() {
    if (!session_) return;
    session_->stop();
    leaving_ = session_;
}

void Northbound::on_alarm(const alarms::Settings& alarm, const alarms::Status& status) {
    if (!session_) return;
    mqtt::State state;
    state.text = alarms::label(status.state);
    state.time = status.since;
    state.body = web::json_text(alarms::describe(alarm, status));
    session_->on_alarm(alarm.name, std::move(state));
}

void Northbound::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    if (session_) session_->on_bus_event(line, event);
}

void Northbound::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    if (session_) session_->on_points(station, wants);
}

std::optional<mqtt::Counters> Northbound::counters() const {
    if (!session_) return std::nullopt;
    return session_->counters();
}

}  // namespace panelgate::gateway
