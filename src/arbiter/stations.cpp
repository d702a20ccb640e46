#include "panelgate/arbiter/stations.hpp"

#include <algorithm>
#include <ranges>
#include <utility>

#include "panelgate/arbiter/timing.hpp"

namespace panelgate::arbiter {

namespace {
constexpr std::size_t kUsualReply = 45;  // bytes: 20 registers
constexpr int kTurn = 3;                 // times the share of one doubtful station
constexpr int kSeveral = 2;              // stations that fail beside another station: an outage
}  // namespace

void Stations::apply(const Settings& settings) {
    offline_settings_ = settings.offline;
    unlisted_ = settings.unlisted;
    standard_gap_ = silent_interval(settings.serial);
    frame_ = frame_time(settings.serial, kUsualReply);
    configured_.clear();
    for (const StationSettings& station : settings.stations) configured_[station.id] = station;
    for (auto& [id, station] : stations_)
        station.apply(this->settings(id), offline_settings_, configured_.contains(id));
    for (const auto& [id, station] : configured_) of(id);
}

const StationSettings& Stations::settings(std::uint8_t id) const {
    const auto found = configured_.find(id);
    return found == configured_.end() ? unlisted_ : found->second;
}

Station& Stations::of(std::uint8_t id) {
    const auto found = stations_.find(id);
    if (found != stations_.end()) return found->second;
    const bool listed = configured_.contains(id);
    return stations_.try_emplace(id, id, settings(id), offline_settings_, listed, frame_)
        .first->second;
}

const Station* Stations::find(std::uint8_t id) const {
    const auto found = stations_.find(id);
    return found == stations_.end() ? nullptr : &found->second;
}

Station* Stations::find(std::uint8_t id) {
    return const_cast<Station*>(std::as_const(*this).find(id));
}

Duration Stations::gap(std::uint8_t id) const {
    return settings(id).frame_gap.value_or(standard_gap_);
}

std::optional<Duration> Stations::slowest() const {
    std::optional<Duration> slowest;
    for (const auto& [id, station] : stations_)
        if (station.health().last_heard())
            slowest = std::max(slowest.value_or(Duration{}), station.think_times().quantile(1));
    return slowest;
}

Duration Stations::latest_reply(std::uint8_t id) const {
    const Station* const found = find(id);
    if (found != nullptr) return found->latest_reply();
    const StationSettings& own = settings(id);
    return own.response_timeout + own.late_window.value_or(own.response_timeout);
}

Duration Stations::response_timeout(std::uint8_t id) const {
    const Station* const found = find(id);
    return found == nullptr ? settings(id).response_timeout : found->response_timeout();
}

StationHealth Stations::health(std::uint8_t id) const {
    const Station* const found = find(id);
    return found == nullptr ? StationHealth(offline_settings_) : found->health();
}

Condition Stations::condition(std::uint8_t id) const {
    const Station* const found = find(id);
    return found == nullptr ? Condition::unheard : found->condition();
}

bool Stations::refuses(TimePoint now, const Job& job) {
    if (job.station == kBroadcast) return false;
    forget_unheard(now);
    Station& station = of(job.station);
    station.on_wanted(now, job.client, job.request);
    if (!station.health().offline() || (station.speculative() && job.search)) return false;
    const bool may_wake = station.speculative() || !job.request.is_read();
    if (!may_wake || !probes(now).allows(now) || !station.take_half_open(now)) return true;
    on_probe(now, job.station);
    return false;
}

bool Stations::may_spend(TimePoint now, const Job& job) const {
    const Station* const station = find(job.station);
    return station == nullptr || now >= affordable_at(now, *station, job.request.is_read());
}

/// While others want the line a station waits for its own share, and a doubtful station for that of
/// suspects. Writes that are ignored beside answered reads have a budget of their own (T14).
TimePoint Stations::affordable_at(TimePoint now, const Station& station, bool is_read) const {
    const bool pays = is_read || !station.answers_reads();
    const TimePoint own = pays ? station.affordable_at() : TimePoint{};
    if (!is_doubtful(now, station, is_read)) return own;
    const auto failing = failing_beside(station);
    const ProbeBudget& budget = pays || failing >= kSeveral ? suspects_ : ignored_writes_;
    const TimePoint shared = budget.next() - credit();
    if (station.failed() == TimePoint{}) return std::max(own, shared);
    // Each doubtful station has a turn, whatever a lossy panel with answered retries spends.
    const Duration turn = kTurn * budget.time_for(station.settings().response_timeout);
    return std::max(own, std::min(shared, station.failed() + (failing + 1) * turn));
}

/// Where panels die together one failure is enough. Where frames get lost, or no panel has failed
/// twice yet, one failure is not enough (T1).
bool Stations::is_doubtful(TimePoint now, const Station& station, bool is_read) const {
    const bool lossy = loses_frames(now) ||
                       std::ranges::none_of(stations_ | std::views::values, &Station::fails_often);
    if (station.is_doubtful(is_read, lossy)) return true;
    return !lossy && station.is_suspect(is_read) && failing_beside(station) >= kSeveral;
}

TimePoint Stations::held_until(TimePoint now, const Job& job) const {
    const Station* const station = find(job.station);
    // A station that answers waits only behind requests of others.
    if (station == nullptr || !is_doubtful(now, *station, job.request.is_read())) return {};
    const TimePoint held = affordable_at(now, *station, job.request.is_read());
    if (held <= now) return held;
    // A search for stations waits for the stations of other clients alone.
    const Client self = station->speculative() ? job.client : 0;
    return std::min(held, others_active_until(job.station, station->failed(), self));
}

TimePoint Stations::others_active_until(std::uint8_t id, TimePoint since, Client self) const {
    TimePoint until{};
    for (const auto& [other_id, other] : stations_) {
        const auto heard = other.health().last_heard();
        const bool is_own = self != 0 && other.wanted_by() == self;
        if (other_id != id && !is_own && heard && *heard > since)
            until = std::max(until, *heard + timing::kOthersActive);
    }
    return until;
}

std::ptrdiff_t Stations::failing_beside(const Station& station) const {
    return std::ranges::count_if(stations_ | std::views::values, [&](const Station& other) {
        const bool fails = other.was_silent() || other.health().suspect();
        return &other != &station && fails && !other.health().offline();
    });
}

bool Stations::affords_retry(TimePoint now, const Station& station, bool damaged) const {
    if (now >= others_active_until(station.id(), {})) return true;
    if (damaged) return now >= station.affordable_at();
    if (loses_frames(now) || failing_beside(station) < kSeveral) return true;
    return now >= station.affordable_at() && now + credit() >= suspects_.next();
}

/// Panels that return together have lost no frames.
void Stations::on_reply(TimePoint now, bool retried) {
    lively_ = now;
    const auto silent = std::ranges::count_if(stations_ | std::views::values, &Station::was_silent);
    if (retried && silent < kSeveral) lost_before_ = std::exchange(lost_, now);
}

void Stations::on_probe(TimePoint now, std::uint8_t id) {
    const Duration cost = settings(id).response_timeout + 2 * gap(id) + frame_;
    offline_.spend(now + cost, cost);
    alone_.spend(now + cost, cost);
}

void Stations::on_failed(TimePoint now, std::uint8_t id, bool is_read, Duration cost) {
    constexpr int kMemory = 3;  // whole timeouts, or failures of this cost
    const Station& station = of(id);
    if (station.health().offline()) return;  // paid for in advance
    const Duration most = kMemory * suspects_.time_for(std::max(unlisted_.response_timeout, cost));
    const bool ignored = !is_read && station.answers_reads() && failing_beside(station) < kSeveral;
    (ignored ? ignored_writes_ : suspects_).spend(now, cost, most);
}

void Stations::on_broadcast(const Asked& broadcast) {
    for (auto& [id, station] : stations_) {
        outstanding_.add(id, broadcast);
        station.on_broadcast(broadcast.sent);
    }
}

void Stations::on_line_down() {
    outstanding_.forget_other_masters();
    for (auto& [id, station] : stations_) station.on_line_down();
}

/// While no station is online, and that has only just begun, nobody is hurt by more probes.
const ProbeBudget& Stations::probes(TimePoint now) const {
    return now < lively_ + timing::kYoungOutage && !any_online() ? alone_ : offline_;
}

bool Stations::any_online() const {
    return std::ranges::any_of(stations_ | std::views::values, [](const Station& station) {
        return !station.health().offline() && station.health().last_heard();
    });
}

std::optional<TimePoint> Stations::probe_at(TimePoint now, const Station& station) const {
    const bool offline = station.health().offline() && !station.speculative();
    if (!offline && !station.wants_check()) return std::nullopt;
    const modbus::Request probe = probe_for(now, station);
    const TimePoint clear = outstanding_.is_proof(now, station.id(), probe, true)
                                ? TimePoint{}
                                : outstanding_.clear_at(now, station.id(), probe, true);
    const TimePoint asked = std::max(clear, station.rests_until());
    if (!offline) return asked;
    return std::max({asked, station.health().next_probe(), probes(now).next()});
}

modbus::Request Stations::probe_for(TimePoint now, const Station& station) const {
    if (auto proof = proof_for(now, station)) return std::move(*proof);
    modbus::Request probe = station.reads().probe();
    const Asked* const read = outstanding_.last_read(now, station.id());
    if (read == nullptr || outstanding_.is_proof(now, station.id(), probe, true)) return probe;
    return modbus::Request::read(*modbus::read_span(read->pdu));
}

std::optional<modbus::Request> Stations::proof_for(TimePoint now, const Station& station) const {
    if (!station.reads().longest()) return std::nullopt;
    const modbus::Request shortest = station.reads().probe();
    if (outstanding_.is_proof(now, station.id(), shortest)) return shortest;
    const modbus::Request& longest = *station.reads().longest();
    if (outstanding_.is_proof(now, station.id(), longest)) return longest;
    if (station.reads().only_known()) return std::nullopt;
    modbus::Span span = *longest.span();
    while (--span.count > 0) {
        modbus::Request part = modbus::Request::read(span);
        if (outstanding_.is_proof(now, station.id(), part)) return part;
    }
    auto longer = station.reads().longer();
    if (longer && !outstanding_.is_proof(now, station.id(), *longer)) longer.reset();
    return longer;
}

std::optional<std::uint8_t> Stations::next_to_probe(TimePoint now) const {
    std::optional<std::uint8_t> best;
    TimePoint earliest = TimePoint::max();
    for (const auto& [id, station] : stations_) {
        const auto at = probe_at(now, station);
        if (!at || *at > now || station.health().next_probe() >= earliest) continue;
        earliest = station.health().next_probe();
        best = id;
    }
    return best;
}

std::optional<TimePoint> Stations::next_probe(TimePoint now) const {
    std::optional<TimePoint> next;
    for (const auto& [id, station] : stations_) {
        const auto at = probe_at(now, station);
        if (at && (!next || *at < *next)) next = at;
    }
    return next;
}

void Stations::forget_unheard(TimePoint now) {
    std::erase_if(stations_, [&](const auto& entry) {
        const auto& [id, station] = entry;
        const bool forgotten = station.speculative() && !outstanding_.any(now, id) &&
                               now >= station.asked() + timing::kForgetUnheard;
        if (forgotten) outstanding_.forget(id);
        return forgotten;
    });
}

}  // namespace panelgate::arbiter
