#include "panelgate/gateway/northbound.hpp"

#include <algorithm>
#include <boost/asio/ip/host_name.hpp>
#include <utility>
#include <variant>

#include "panelgate/base/words.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/judge.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

namespace json = boost::json;
namespace {

constexpr std::size_t kSwept = 500;  ///< subjects per turn: well below a millisecond
constexpr Duration kSweep = 1s;
constexpr Duration kRebirth = 1s;  ///< minimum interval: hosts may ask as often as they like

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

BrokerSession::BrokerSession(boost::asio::any_io_executor executor, rt::Clock& clock,
                             std::shared_ptr<const Snapshot> snapshot, TopicRefusals refused)
    : clock_(clock),
      settings_(completed(*snapshot->config->mqtt)),
      publisher_(settings_, explain::subjects_of(*snapshot->config)),
      alarm_(clock.make_alarm()),
      rebirth_alarm_(clock.make_alarm()),
      refused_(std::move(refused)),
      who_(explain::client_of(settings_)),
      writes_(std::make_shared<Writes>(Writes{this, bus::next_client_id()})),
      client_(std::move(executor), clock, settings_, publisher_,
              [this](const mqtt::Command& command) { on_command(command); }) {
    show(std::move(snapshot));
}

bool BrokerSession::fits(const Snapshot& snapshot) const {
    const auto& mqtt = snapshot.config->mqtt;
    return mqtt && completed(*mqtt) == settings_ &&
           explain::subjects_of(*snapshot.config) == publisher_.subjects();
}

void BrokerSession::show(std::shared_ptr<const Snapshot> snapshot) {
    snapshot_ = std::move(snapshot);
    numbers_.clear();
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
    certificate_expiry_ = tls::summary_of(files.certificate).end;
    client_.renew(files);
}

void BrokerSession::take_over(BrokerSession& before) {
    publisher_.take_over(before.publisher_);
    counters_ = before.counters();
    if (settings_.broker() != before.settings_.broker())
        return;  // the clients of those writes are at the other broker
    writes_ = std::move(before.writes_);
    writes_->session = this;
}

void BrokerSession::start() {
    for (std::size_t i = 0; i < places_.size(); ++i)
        if (auto state = seen(i)) publisher_.know(i, std::move(*state));
    client_.start();
    sweep();
}

std::unique_ptr<mqtt::GracefulClose> BrokerSession::stop() {
    alarm_->cancel();
    rebirth_alarm_->cancel();
    auto leaving = client_.stop();
    if (!writes_) return leaving;
    for (const Place& place : places_)
        if (place.station != nullptr && place.point == nullptr)
            place.station->bus->cancel(writes_->client);
    writes_.reset();
    return leaving;
}

void BrokerSession::offer(std::size_t subject, mqtt::State state) {
    if (publisher_.offer(subject, std::move(state))) client_.wake();
}

mqtt::State BrokerSession::state_of(const Station& station, const points::Point& point) const {
    const TimePoint now = clock_.now();
    const points::PointReading reading = station.points->read(point, now);
    mqtt::State state;
    state.value = reading.value;
    state.text = reading.label.value_or("");
    state.quality = reading.quality;
    state.time = rt::wall_now();
    if (reading.value && reading.age)
        state.time = wall_time_of(now - *reading.age, now, state.time);
    return state;
}

/// The current state of a subject; nothing for lines, which report by on_bus_event().
std::optional<mqtt::State> BrokerSession::seen(std::size_t subject) const {
    const Place& place = places_[subject];
    if (place.station == nullptr) return std::nullopt;
    if (place.point != nullptr) return state_of(*place.station, *place.point);
    const Health health = place.station->bus->station_status(place.station->id).state;
    mqtt::State state;
    state.value = health != Health::offline && health != Health::unknown;
    state.text = label(health);
    state.time = rt::wall_now();
    return state;
}

void BrokerSession::look(std::size_t subject) {
    if (auto state = seen(subject)) offer(subject, std::move(*state));
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

void BrokerSession::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    if (const auto* of_station = std::get_if<arbiter::StationEvent>(&event)) {
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const Place& place = places_[i];
            if (place.station != nullptr && place.point == nullptr && place.station->line == line &&
                place.station->id == of_station->station)
                look(i);
        }
    }
    const auto* of_line = std::get_if<bus::LineEvent>(&event);
    const auto subject = publisher_.subjects().find_line(line);
    if (of_line == nullptr || !subject || (of_line->up && !of_line->why.empty())) return;
    mqtt::State state;
    state.value = of_line->up;
    state.text = of_line->up ? "up" : "down: " + of_line->why;
    state.time = rt::wall_now();
    offer(*subject, std::move(state));
    for (std::size_t i = 0; i < places_.size(); ++i) {  // its stations are unknown now
        const Place& place = places_[i];
        if (place.station != nullptr && place.point == nullptr && place.station->line == line)
            look(i);
    }
}

void BrokerSession::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    const auto numbers = numbers_.find(&station);
    if (numbers == numbers_.end() || !station.points) return;
    for (const std::size_t want : wants)
        if (want < numbers->second.points.size()) look(numbers->second.points[want]);
    look(numbers->second.station);  // it may have answered for the first time
}

void BrokerSession::on_command(const mqtt::Command& command) {
    if (std::holds_alternative<mqtt::Rebirth>(command)) {
        if (std::exchange(rebirth_waits_, true)) return;
        rebirth_alarm_->arm(std::max(clock_.now(), next_rebirth_), [this] { on_rebirth(); });
    } else if (const auto* bad = std::get_if<mqtt::BadCommand>(&command)) {
        refuse(bad->topic, bad->id, web::problem(400, bad->why), {});
    } else {
        write(std::get<mqtt::WriteCommand>(command));
    }
}

void BrokerSession::on_rebirth() {
    rebirth_waits_ = false;
    next_rebirth_ = clock_.now() + kRebirth;
    publisher_.rebirth();
    client_.wake();
}

void BrokerSession::refuse(const std::string& topic, const std::string& id, const web::Problem& why,
                           const Place& place) {
    if (refused_) {
        const TopicRefusal refusal{who_, topic, why, place.station, place.point};
        refused_(refusal);
    }
    answer_refused(topic, id, why);
}

void BrokerSession::answer_refused(const std::string& topic, const std::string& id,
                                   const web::Problem& why) {
    ++counters_.writes_refused;
    rt::log(rt::LogLevel::warn, "mqtt write refused",
            {{"client", "mqtt"}, {"topic", web::excerpt(topic)}, {"why", why.detail}});
    json::object body{{"ok", false}};
    for (const auto& [name, value] : web::json_of(why)) body[name] = value;
    publisher_.answer({topic, id, web::json_text(body)}, true);
    client_.wake();
}

void BrokerSession::write(const mqtt::WriteCommand& command) {
    const Place& place = places_[command.point];
    const Station& station = *place.station;
    const std::string topic = publisher_.topic_of(command.point);
    if (writes_->open >= settings_.writes)
        return refuse(topic, command.id, web::problem(503, "too many writes are under way"), place);
    if (!publisher_.has_room_for_answer(writes_->open))
        return refuse(topic, command.id, web::problem(503, "too many answers wait for the broker"),
                      place);
    const profile::ProfileRef profile = station.configured->profile;
    auto order = web::order_of(*station.bus, station.id, *profile, *place.point, command.value);
    if (!order) {
        publisher_.repeat(command.point);  // for clients that ignore our answers
        return refuse(topic, command.id, order.error(), place);
    }
    bus::Request request = order->request;
    request.client = writes_->client;
    request.who = who_;
    station.bus->name_client(writes_->client, "mqtt");
    ++writes_->open;
    auto made = std::make_shared<const Order>(
        Order{station.name, place.point->name, topic, command.id, profile, std::move(*order)});
    station.bus->transact(std::move(request), [writes = std::weak_ptr<Writes>(writes_),
                                               made = std::move(made)](const bus::Answer& answer) {
        const auto open = writes.lock();
        if (!open) return;
        --open->open;
        open->session->finish(*made, answer);
    });
}

void BrokerSession::finish(const Order& order, const bus::Answer& answer) {
    const auto result = web::write_result(order.order, answer, *order.profile);
    const auto point = publisher_.subjects().find_point(order.station, order.point);
    if (!result && point) publisher_.repeat(*point);
    if (!result && answer.refusal) return answer_refused(order.topic, order.id, result.error());
    ++(result ? counters_.writes_ok : counters_.writes_failed);
    json::object body{{"ok", static_cast<bool>(result)}};
    for (const auto& [name, value] : result ? *result : web::json_of(result.error()))
        body[name] = value;
    publisher_.answer({order.topic, order.id, web::json_text(body)}, false);
    client_.wake();
}

mqtt::Counters BrokerSession::counters() const {
    mqtt::Counters all = client_.counters();
    all.published += counters_.published;
    all.dropped += counters_.dropped;
    all.results_dropped += counters_.results_dropped;
    all.reconnects += counters_.reconnects;
    all.writes_ok = counters_.writes_ok;
    all.writes_refused = counters_.writes_refused;
    all.writes_failed = counters_.writes_failed;
    all.broker = settings_.broker();
    all.certificate_expiry = certificate_expiry_;
    return all;
}

Northbound::Northbound(boost::asio::any_io_executor executor, rt::Clock& clock,
                       TopicRefusals refused)
    : executor_(std::move(executor)), clock_(clock), refused_(std::move(refused)) {}

void Northbound::show(const std::shared_ptr<const Snapshot>& snapshot) {
    if (session_ && session_->fits(*snapshot)) return session_->show(snapshot);
    std::unique_ptr<BrokerSession> next;
    if (snapshot->config->mqtt)
        next = std::make_unique<BrokerSession>(executor_, clock_, snapshot, refused_);
    if (session_ && next) next->take_over(*session_);
    leave();
    session_ = std::move(next);
    if (session_ && running_) session_->start();
}

void Northbound::renew(const tls::Material& files) {
    if (session_) session_->renew(files);
}

void Northbound::start() {
    running_ = true;
    if (session_) session_->start();
}

void Northbound::stop() {
    running_ = false;
    leave();
}

void Northbound::leave() {
    auto leaving = session_ ? session_->stop() : nullptr;
    if (leaving) closing_ = std::move(leaving);
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
