#include "panelgate/arbiter/stations.hpp"

#include <algorithm>

#include "panelgate/modbus/request.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

namespace {
constexpr std::size_t kUsualReply = 45;  // bytes: 20 registers
}

Stations::Stations(const Settings& settings) { apply(settings); }

void Stations::apply(const Settings& settings) {
    offline_ = settings.offline;
    unlisted_ = settings.unlisted;
    standard_gap_ = silent_interval(settings.serial);
    frame_ = frame_time(settings.serial, kUsualReply);
    configured_.clear();
    for (const StationSettings& station : settings.stations) configured_[station.id] = station;
    for (auto& [id, station] : stations_)
        station.apply(this->settings(id), offline_, configured_.contains(id));
}

const StationSettings& Stations::settings(std::uint8_t id) const {
    const auto found = configured_.find(id);
    return found == configured_.end() ? unlisted_ : found->second;
}

Station& Stations::of(std::uint8_t id) {
    const auto found = stations_.find(id);
    if (found != stations_.end()) return found->second;
    const bool listed = configured_.contains(id);
    return stations_.try_emplace(id, settings(id), offline_, listed, frame_).first->second;
}

const Station* Stations::find(std::uint8_t id) const {
    const auto found = stations_.find(id);
    return found == stations_.end() ? nullptr : &found->second;
}

Duration Stations::gap(std::uint8_t id) const {
    return settings(id).frame_gap.value_or(standard_gap_);
}

Duration Stations::patience(TimePoint now, const Group& group) {
    const Station& station = of(group.station);
    const bool poor = station.in_debt(now) && has_company(now, station);
    const bool hurry = now < hurry_until_ || poor;
    Duration wait = station.patience(group, slowest(), hurry, spent(now, station));
    const Duration whole = settings(group.station).response_timeout;
    for (const Job& job : group.jobs) wait = std::max(wait, std::min(job.patience, whole));
    return wait;
}

TimePoint Stations::company_until(const Station& station) const {
    TimePoint until{};
    for (const auto& [id, other] : stations_) {
        const auto answered = other.health().last_heard();
        if (&other != &station && answered && *answered > station.failed())
            until = std::max(until, *answered + kCompany);
    }
    return until;
}

TimePoint Stations::held_until(std::uint8_t id) const {
    const Station* station = find(id);
    if (station == nullptr || !station->failing()) return {};
    return std::min(station->affordable_at(), company_until(*station));
}

bool Stations::is_stranger(std::uint8_t id) const {
    const Station* station = find(id);
    return id != kBroadcast &&
           (station == nullptr ? !configured_.contains(id) : station->stranger());
}

bool Stations::may_spend(TimePoint now, const Job& job) const {
    if (is_stranger(job.station)) return strangers_.allows(now, surprise());
    const Station* station = find(job.station);
    if (station == nullptr) return true;
    // A write that is ignored says nothing of reads while these are answered.
    const bool is_read = job.request.is_read();
    const bool is_suspect = station->suspect() && !(is_read && station->answers_reads());
    return (!is_suspect || suspects_.allows(now)) &&
           station->may_spend(now, is_read ? nullptr : &job.request);
}

/// A client's request may be the probe once an interval, as far as the budget goes.
bool Stations::refuses(TimePoint now, const Job& job) {
    if (job.station == kBroadcast) return false;
    forget_strangers(now);
    Station& station = of(job.station);
    if (station.stranger()) station.on_wanted(now);
    if (!station.health().offline()) return false;
    if (station.stranger() && job.search) return false;
    const bool may_wake = station.stranger() || !job.request.is_read();
    const ProbeBudget& budget = station.stranger() ? known_strangers_ : probes();
    if (may_wake && budget.allows(now) && station.take_half_open(now, job.request.is_read()))
        return false;
    station.on_refused(job.request);
    return true;
}

TimePoint Stations::clear_at(TimePoint now, bool may_stall) const {
    TimePoint clear{};
    for (const auto& [id, station] : stations_) {
        if (!station.owes()) continue;
        clear = std::max(clear, station.rested());
        if (may_stall) clear = std::max(clear, now + station.latest_reply());
    }
    return clear;
}

Duration Stations::latest_reply(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? 2 * settings(id).response_timeout : found->latest_reply();
}

StationHealth Stations::health(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? StationHealth(offline_) : found->health();
}

Duration Stations::response_timeout(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? settings(id).response_timeout : found->response_timeout();
}

void Stations::on_failed(TimePoint now, const Group& group, Verdict verdict, Duration cost) {
    Station& station = of(group.station);
    station.on_failed(now, verdict, cost, group.request.is_read() ? nullptr : &group.request);
    if (station.stranger()) {
        strangers_.spend(now, cost, 2 * surprise());
        if (station.health().offline()) known_strangers_.spend(now, cost, kCompany);
    } else if (station.health().offline()) {
        probes_.spend(now, cost);
        alone_.spend(now, cost);
    } else if (station.suspect()) {
        suspects_.spend(now, cost);
    } else if (verdict == Verdict::silent) {
        // It may be one of several that have died together: the others are not waited for longer
        // than they have ever needed, for as long as this one has taken a fifth of.
        hurry_until_ =
            now + std::min<Duration>(static_cast<int>(1 / ProbeBudget::kFailing) * cost, kHurry);
    }
}

/// What is offline has to pay for it.
std::optional<TimePoint> Stations::probe_at(const Station& station) const {
    if (station.wants_check()) return station.probe_due();
    if (!station.health().offline() || station.stranger()) return std::nullopt;
    return std::max(station.probe_due(), probes().next());
}

std::optional<std::uint8_t> Stations::next_to_probe(TimePoint now) const {
    std::optional<std::uint8_t> best;
    TimePoint earliest = TimePoint::max();
    for (const auto& [id, station] : stations_) {
        const auto at = probe_at(station);
        if (!at || *at > now || station.probe_due() >= earliest) continue;
        earliest = station.probe_due();
        best = id;
    }
    return best;
}

std::optional<TimePoint> Stations::next_probe() const {
    std::optional<TimePoint> next;
    for (const auto& [id, station] : stations_) {
        const auto at = probe_at(station);
        if (at && (!next || *at < *next)) next = at;
    }
    return next;
}

bool Stations::anyone_online() const {
    return std::ranges::any_of(stations_, [](const auto& entry) {
        const StationHealth& health = entry.second.health();
        return !health.offline() && health.last_heard();
    });
}

void Stations::forget_strangers(TimePoint now) {
    std::erase_if(stations_, [&](const auto& entry) { return entry.second.forgettable(now); });
}

}  // namespace panelgate::arbiter
