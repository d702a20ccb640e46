#include "panelgate/gateway/alarm_desk.hpp"

#include <algorithm>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <utility>

#include "panelgate/points/station_points.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway {

namespace json = boost::json;

namespace {

constexpr Duration kAlarmLook = 1s;
constexpr std::string_view kAlarmKey = "alarm/";

store::Kind kind_of(alarms::Change::Kind kind) {
    if (kind == alarms::Change::Kind::raised) return store::Kind::alarm_raised;
    if (kind == alarms::Change::Kind::cleared) return store::Kind::alarm_cleared;
    return store::Kind::alarm_acknowledged;
}

/// What the store keeps of an alarm; "" of a normal one.
std::string kept_text(const alarms::Status& status) {
    if (status.state == alarms::State::normal) return {};
    json::object kept;
    kept["state"] = alarms::label(status.state);
    kept["since"] = status.since.time_since_epoch().count();
    kept["by"] = status.by;
    if (status.value) kept["value"] = *status.value;
    return json::serialize(kept);
}

/// Nothing if the text is none of kept_text().
std::optional<alarms::Status> parse_kept(const std::string& text) {
    boost::system::error_code wrong;
    const json::value value = json::parse(text, wrong);
    const auto* const kept = wrong ? nullptr : value.if_object();
    if (kept == nullptr) return std::nullopt;
    try {
        alarms::Status status;
        status.state = alarms::state_of(kept->at("state").as_string()).value();
        status.since = WallTime(WallTime::duration(kept->at("since").as_int64()));
        status.by = kept->at("by").as_string();
        if (const auto* number = kept->if_contains("value"))
            status.value = number->to_number<double>();
        return status;
    } catch (const std::exception&) {
        return std::nullopt;
    }
}

std::string point_of(const alarms::Settings& alarm) { return alarm.station + '/' + alarm.point; }

}  // namespace

AlarmDesk::AlarmDesk(rt::Clock& clock, Journal& journal, Findings findings, Listener tell,
                     Announcement announce)
    : clock_(clock),
      journal_(journal),
      findings_(std::move(findings)),
      tell_(std::move(tell)),
      announce_(std::move(announce)),
      alarm_(clock.make_alarm()) {}

alarms::Alarms::Time AlarmDesk::time() const { return {clock_.now(), rt::wall_now()}; }

void AlarmDesk::apply(const std::vector<alarms::Settings>& settings,
                      std::shared_ptr<const Plant> plant) {
    plant_ = std::move(plant);
    alarms_.apply(settings);
    by_point_.clear();
    for (std::size_t i = 0; i < alarms_.size(); ++i)
        if (!alarms_.settings(i).point.empty()) by_point_.emplace(point_of(alarms_.settings(i)), i);
    announce_all();
    if (asked_) return;
    asked_ = true;
    journal_.ask_kept(kAlarmKey, [this, life = std::weak_ptr(alive_)](const Journal::Texts& kept) {
        if (!life.expired()) restore(kept);
    });
}

void AlarmDesk::restore(const std::vector<std::pair<std::string, std::string>>& kept) {
    for (const auto& [key, text] : kept)
        if (auto status = parse_kept(text))
            alarms_.restore(std::string_view(key).substr(kAlarmKey.size()), std::move(*status));
    ready_ = true;
    announce_all();
    look();
}

void AlarmDesk::announce_all() const {
    if (!ready_) return;
    for (std::size_t i = 0; i < alarms_.size(); ++i)
        announce_(alarms_.settings(i), alarms_.status(i));
}

/// The lines and findings as they are now: asked once for all alarms.
AlarmDesk::Sights AlarmDesk::look_around() const {
    Sights sights;
    for (const web::Finding& finding : findings_()) sights.findings.insert(finding.cause);
    for (const Line& line : plant_->lines()) {
        const bus::LineStatus status = line.bus->status();
        if (!status.up) sights.down.insert(line.configured->name);
        for (const bus::LineFinding& finding : status.findings)
            sights.findings.insert(finding.cause);
    }
    return sights;
}

/// Looks at every alarm's condition, and at delays that have passed.
void AlarmDesk::look() {
    if (alarms_.size() > 0) {
        const Sights sights = look_around();
        for (std::size_t i = 0; i < alarms_.size(); ++i) on_change(look_at(i, sights));
        for (const alarms::Change& change : alarms_.on_time(time())) on_change(change);
    }
    alarm_->arm(clock_.now() + kAlarmLook, [this] { look(); });
}

std::optional<alarms::Change> AlarmDesk::look_at(std::size_t alarm, const Sights& sights) {
    const alarms::Settings& of = alarms_.settings(alarm);
    if (!of.finding.empty())
        return alarms_.on_condition(
            alarm, time(),
            of.finding == "any" ? !sights.findings.empty() : sights.findings.contains(of.finding));
    if (of.down) return alarms_.on_condition(alarm, time(), sights.down.contains(of.line));
    const Station* const station = plant_->find(of.station);
    if (station == nullptr) return std::nullopt;
    if (of.offline) {
        const auto health = station->bus->station_status(station->id).state;
        const bool is_gone = health == Health::offline || sights.down.contains(station->line);
        return alarms_.on_condition(alarm, time(), is_gone);
    }
    const points::Point* const point = station->points ? station->points->find(of.point) : nullptr;
    if (point == nullptr) return std::nullopt;
    return alarms_.on_value(alarm, time(),
                            station->points->read(*point, clock_.now()).good_number());
}

void AlarmDesk::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    if (!ready_ || by_point_.empty() || !station.points) return;
    for (const std::size_t want : wants) {
        const points::Point* const point = station.points->point_of(want);
        if (point == nullptr) continue;
        const auto value = station.points->read(*point, clock_.now()).good_number();
        const auto [first, last] = by_point_.equal_range(station.name + '/' + point->name);
        for (auto at = first; at != last; ++at)
            on_change(alarms_.on_value(at->second, time(), value));
    }
}

void AlarmDesk::on_change(const std::optional<alarms::Change>& change) {
    if (!change) return;
    const alarms::Settings& alarm = *change->alarm;
    store::Entry entry;
    entry.kind = kind_of(change->kind);
    entry.severity = alarm.severity;
    entry.station = alarm.station;
    entry.point = alarm.point;
    entry.line = line_of(alarm);
    entry.text = alarm.shown();
    if (change->kind == alarms::Change::Kind::acknowledged) entry.who = change->now.by;
    json::object data;
    data["alarm"] = alarm.name;
    if (change->now.value) data["value"] = *change->now.value;
    entry.data = json::serialize(data);
    journal_.add(std::move(entry));
    journal_.keep(std::string(kAlarmKey) + alarm.name, kept_text(change->now));
    tell_(*change);
    announce_(alarm, change->now);
}

std::string AlarmDesk::line_of(const alarms::Settings& alarm) const {
    const Station* const station = plant_->find(alarm.station);
    return station != nullptr ? station->line : alarm.line;
}

std::vector<web::AlarmView> AlarmDesk::list() const {
    std::vector<web::AlarmView> list;
    for (std::size_t i = 0; i < alarms_.size(); ++i) {
        const alarms::Settings& of = alarms_.settings(i);
        list.push_back({of, alarms_.status(i), line_of(of)});
    }
    return list;
}

web::AlarmSource::Acknowledged AlarmDesk::acknowledge(const std::string& name,
                                                      const std::string& who) {
    if (!alarms_.find(name)) return Acknowledged::unknown;
    const auto change = alarms_.acknowledge(name, who);
    if (!change) return Acknowledged::nothing;
    on_change(change);
    return Acknowledged::done;
}

}  // namespace panelgate::gateway
