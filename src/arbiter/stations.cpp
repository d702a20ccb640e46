#include "panelgate/arbiter/stations.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <algorithm>

#include "panelgate/modbus/request.hpp"

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
        station.apply(own_settings(id), offline_, configured_.contains(id));
}

const StationSettings& Stations::settings(std::uint8_t id) const {
    const auto found = configured_.find(id);
    return found == configured_.end() ? unlisted_ : found->second;
}

StationSettings Stations::own_settings(std::uint8_t id) const {
    StationSettings own = settings(id);
    own.id = id;
    return own;
}

Station& Stations::of(std::uint8_t id) {
    const auto found = stations_.find(id);
    if (found != stations_.end()) return found->second;
    const bool listed = configured_.contains(id);
    return stations_.try_emplace(id, own_settings(id), offline_, listed, frame_).first->second;
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
    const bool over = station.over_budget(now, group.request) && others_active(now, station);
    // Not a write: it may need longer, and its outcome is worth waiting for.
    const bool urgent = (now < urgent_until_ && group.request.is_read()) || over;
    Duration wait = station.patience(group, slowest(), urgent, flaky_beside_others(now, station));
    const Duration whole = settings(group.station).response_timeout;
    for (const Job& job : group.jobs) wait = std::max(wait, std::min(job.patience, whole));
    return wait;
}

TimePoint Stations::others_active_until(const Station& station) const {
    TimePoint until{};
    const TimePoint failed =
        station.health().last_heard() > station.failed() ? TimePoint{} : station.failed();
    for (const auto& [id, other] : stations_) {
        const auto answered = other.health().last_heard();
        if (&other != &station && answered && *answered > failed)
            until = std::max(until, *answered + timing::kOthersActive);
    }
    return until;
}

TimePoint Stations::throttled_until(std::uint8_t id) const {
    const Station* station = find(id);
    if (station == nullptr || !station->failing()) return {};
    return std::min(station->affordable_at(), others_active_until(*station));
}

bool Stations::is_speculative(std::uint8_t id) const {
    const Station* station = find(id);
    return id != kBroadcast &&
           (station == nullptr ? !configured_.contains(id) : station->speculative());
}

bool Stations::may_spend(TimePoint now, const Job& job) const {
    if (is_speculative(job.station)) return unheard_.allows(now, timeout_cost());
    const Station* station = find(job.station);
    if (station == nullptr) return true;
    // An ignored write says nothing about reads while these are answered.
    const bool is_read = job.request.is_read();
    const bool is_missed = station->missed_last() && !(is_read && station->answers_reads());
    return (!is_missed || newly_silent_.allows(now)) &&
           station->may_spend(now, is_read ? nullptr : &job.request);
}

/// A client's request may be the probe once an interval, within the budget.
bool Stations::refuses(TimePoint now, const Job& job) {
    if (job.station == kBroadcast) return false;
    forget_unheard(now);
    Station& station = of(job.station);
    if (station.speculative()) station.on_wanted(now);
    if (!station.health().offline()) return false;
    if (station.speculative() && job.search) return false;
    const bool may_wake = station.speculative() || !job.request.is_read();
    const ProbeBudget& budget = station.speculative() ? asked_unheard_ : probes();
    if (may_wake && budget.allows(now) && station.take_half_open(now, job.request.is_read()))
        return false;
    station.replies().on_wanted(job.request);
    return true;
}

TimePoint Stations::clear_at(TimePoint now, bool may_stall) const {
    TimePoint clear{};
    for (const auto& [id, station] : stations_) {
        if (!book_.any(id)) continue;
        clear = std::max(clear, station.replies().rested());
        if (may_stall) clear = std::max(clear, now + station.replies().latest_reply());
    }
    return clear;
}

Duration Stations::latest_reply(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? 2 * settings(id).response_timeout : found->replies().latest_reply();
}

StationHealth Stations::health(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? StationHealth(offline_) : found->health();
}

Condition Stations::condition(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? Condition::unheard : found->condition();
}

Duration Stations::response_timeout(std::uint8_t id) const {
    const Station* found = find(id);
    return found == nullptr ? settings(id).response_timeout : found->response_timeout();
}

void Stations::on_failed(TimePoint now, const Group& group, Verdict verdict, Duration cost,
                         bool disturbed) {
    Station& station = of(group.station);
    station.on_failed(now, verdict, cost, group.request.is_read() ? nullptr : &group.request);
    if (station.speculative()) {
        unheard_.spend(now, cost, 2 * timeout_cost());
        if (station.health().offline()) asked_unheard_.spend(now, cost, timing::kOthersActive);
    } else if (station.health().offline()) {
        probes_.spend(now, cost);
        alone_.spend(now, cost);
    } else if (station.missed_last()) {
        newly_silent_.spend(now, cost);
    } else if (verdict == Verdict::silent && !disturbed) {
        // Several stations may have failed together: for five times what this one took, the others
        // are not waited for longer than they have ever needed. Who was disturbed had not.
        const Duration urgent = static_cast<int>(1 / ProbeBudget::kFailing) * cost;
        urgent_until_ = std::max(urgent_until_, now + std::min<Duration>(urgent, timing::kUrgent));
    }
}

/// Probes of offline stations must be within their budget.
std::optional<TimePoint> Stations::probe_at(const Station& station) const {
    if (station.wants_check()) return station.probe_due(book_);
    if (!station.health().offline() || station.speculative()) return std::nullopt;
    return std::max(station.probe_due(book_), probes().next());
}

std::optional<std::uint8_t> Stations::next_to_probe(TimePoint now) const {
    std::optional<std::uint8_t> best;
    TimePoint earliest = TimePoint::max();
    for (const auto& [id, station] : stations_) {
        const auto at = probe_at(station);
        if (!at || *at > now || station.probe_due(book_) >= earliest) continue;
        earliest = station.probe_due(book_);
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

bool Stations::any_online() const {
    return std::ranges::any_of(stations_, [](const auto& entry) {
        const StationHealth& health = entry.second.health();
        return !health.offline() && health.last_heard();
    });
}

void Stations::forget_unheard(TimePoint now) {
    std::erase_if(stations_, [&](const auto& entry) {
        const bool forgotten = entry.second.forgettable(book_, now);
        if (forgotten) book_.forget(entry.first);
        return forgotten;
    });
}

}  // namespace panelgate::arbiter
