#include "panelgate/points/station_polls.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::points {

PollSchedule::PollSchedule(std::span<const Duration> intervals, TimePoint start,
                           const Settings& settings)
    : start_(start), settings_(settings), entries_(intervals.size()) {
    settings_.extra_burst = std::max<std::size_t>(settings_.extra_burst, 1);
    set_phases(intervals);
    for (std::size_t i = 0; i < entries_.size(); ++i) queue_.emplace(entries_[i].due, i);
}

void PollSchedule::set_phases(std::span<const Duration> intervals) {
    std::map<Duration, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < intervals.size(); ++i)
        groups[std::max(intervals[i], kMinInterval)].push_back(i);
    if (groups.empty()) return;
    // Shifts the groups against each other by a part of the shortest step: 1 s and 2 s would
    // otherwise coincide every 2 s.
    Duration shortest = Duration::max();
    for (const auto& [every, members] : groups)
        shortest = std::min(shortest, every / static_cast<Duration::rep>(members.size()));
    const Duration shift = shortest / static_cast<Duration::rep>(groups.size());
    const Duration first_step =
        settings_.first_within / static_cast<Duration::rep>(intervals.size());
    Duration first{};  // the shortest intervals come first
    Duration offset{};
    for (const auto& [every, members] : groups) {
        const auto count = static_cast<Duration::rep>(members.size());
        const Duration step = every / count;
        for (Duration::rep k = 0; k < count; ++k) {
            const Duration phase = k * step + offset;
            entries_[members[static_cast<std::size_t>(k)]] = {
                every, phase, start_ + std::min(phase, first), false};
            first += first_step;
        }
        offset += shift;
    }
}

/// Moves an entry to its first turn after `now`.
void PollSchedule::advance(std::size_t index, TimePoint now) {
    Entry& entry = entries_[index];
    const TimePoint origin = start_ + entry.phase;
    const Duration::rep turns = now < origin ? 0 : (now - origin) / entry.every + 1;
    queue_.erase({entry.due, index});
    entry.due = origin + turns * entry.every;
    entry.is_extra = false;
    queue_.emplace(entry.due, index);
}

std::optional<TimePoint> PollSchedule::next_due() const {
    if (queue_.empty() || under_way_) return std::nullopt;
    return queue_.begin()->first;
}

std::optional<std::size_t> PollSchedule::take_due(TimePoint now) {
    const auto due = next_due();
    if (!due || *due > now) return std::nullopt;
    under_way_ = queue_.begin()->second;
    advance(*under_way_, now);
    return under_way_;
}

void PollSchedule::request_extra_turn(std::size_t index, TimePoint now) {
    Entry& entry = entries_[index];
    if (under_way_ == index || entry.is_extra) return;
    const Duration burst =
        settings_.extra_every * static_cast<Duration::rep>(settings_.extra_burst - 1);
    const TimePoint turn = std::max({now, extra_free_ - burst, last_extra_ + 1ns});
    if (entry.due <= turn) return;
    last_extra_ = turn;
    extra_free_ = std::max(extra_free_, now) + settings_.extra_every;
    retry_at(index, turn);
    entry.is_extra = true;
}

void PollSchedule::retry_at(std::size_t index, TimePoint when) {
    Entry& entry = entries_[index];
    if (under_way_ == index || entry.due <= when) return;
    queue_.erase({entry.due, index});
    entry.due = when;
    queue_.emplace(entry.due, index);
}

void PollSchedule::on_done(std::size_t index, TimePoint now) {
    if (under_way_ != index) return;
    under_way_.reset();
    // A turn due meanwhile is lost, or this entry would overtake those waiting.
    if (entries_[index].due <= now) advance(index, now);
}

namespace {

/// Delay before reading again what was written, when the read after the write failed.
constexpr Duration kRereadAfterFailure = 5s;
/// … when that read was not sent, as while a connection is being reopened.
constexpr Duration kRereadUnsent = 500ms;

std::vector<Duration> intervals_of(const std::vector<PlannedRead>& plan) {
    std::vector<Duration> intervals;
    for (const PlannedRead& read : plan) intervals.push_back(read.every);
    return intervals;
}

PollSchedule schedule_of(const std::vector<PlannedRead>& plan, TimePoint start) {
    return PollSchedule(intervals_of(plan), start, PollSchedule::Settings());
}

}  // namespace

std::vector<std::uint16_t> items_of(const modbus::Span& span, ByteView reply) {
    if (!modbus::is_bit_table(span.table)) return modbus::registers_of(reply);
    const std::vector<bool> bits = modbus::bits_of(reply, span.count);
    return {bits.begin(), bits.end()};
}

std::string_view label(Quality quality) {
    if (quality == Quality::good) return "good";
    return quality == Quality::stale ? "stale" : "bad";
}

std::optional<bool> SharedMemory::changes(const modbus::Span& written,
                                          const modbus::Span& items) const {
    if (!shown_as) return std::nullopt;
    return std::ranges::any_of(shown_as(written),
                               [&](const modbus::Span& shown) { return shown.overlaps(items); });
}

Duration bad_after(Duration every) { return std::max<Duration>(10 * every, 10s); }

Quality quality_of(const Reading& reading, Duration every, TimePoint now) {
    if (!reading.sampled) return Quality::bad;
    const Duration age = now - *reading.sampled;
    if (age > bad_after(every)) return Quality::bad;
    return reading.failing || reading.outdated() || age > 2 * every + 1s ? Quality::stale
                                                                         : Quality::good;
}

StationPolls::StationPolls(std::vector<Want> wants, PlanLimits limits, TimePoint start,
                           SharedMemory memory)
    : wants_(std::move(wants)),
      readings_(wants_.size()),
      plan_(plan_reads(wants_, limits)),
      schedule_(schedule_of(plan_, start)),
      memory_(std::move(memory)) {
    std::vector<int> reads(wants_.size());
    for (const PlannedRead& read : plan_) {
        for (const std::size_t want : read.wants) {
            if (++reads[want] > 1) pieces_[want];
        }
    }
}

void StationPolls::adopt(const StationPolls& before) {
    adopt_readings(wants_, readings_, before.wants_, before.readings_);
}

void adopt_readings(const std::vector<Want>& wants, std::vector<Reading>& readings,
                    const std::vector<Want>& known_wants, const std::vector<Reading>& known) {
    const auto order = [](const modbus::Span& span) {
        return std::tuple(span.table, span.first, span.count);
    };
    std::map<std::tuple<modbus::Table, std::uint32_t, std::uint32_t>, std::size_t> places;
    for (std::size_t i = 0; i < known_wants.size(); ++i)
        places.emplace(order(known_wants[i].span), i);
    for (std::size_t i = 0; i < wants.size(); ++i) {
        const auto found = places.find(order(wants[i].span));
        if (found != places.end()) readings[i] = known[found->second];
    }
}

std::optional<StationPolls::Due> StationPolls::take_due(TimePoint now) {
    const auto read = schedule_.take_due(now);
    if (!read) return std::nullopt;
    return Due{*read, modbus::Request::read(plan_[*read].span)};
}

std::vector<std::size_t> StationPolls::on_answer(TimePoint now, std::size_t read,
                                                 const Result<Bytes>& pdu, TimePoint sampled) {
    schedule_.on_done(read, now);
    const PlannedRead planned = plan_[read];
    // Written since the request was sent: the result is outdated in any case.
    const bool written_meanwhile = std::ranges::any_of(planned.wants, [&](std::size_t want) {
        return readings_[want].written && sampled < *readings_[want].written;
    });
    if (written_meanwhile) schedule_.request_extra_turn(read, now);
    const auto exception = pdu ? modbus::exception_of(*pdu) : std::nullopt;
    const bool good = pdu && !exception && store(planned, *pdu, sampled);
    if (!good) {
        const bool about_range = exception && (*exception == 2 || *exception == 3);
        if (about_range && split(now, read)) return {};
        fail(planned, exception);
        const bool not_sent = !pdu && pdu.error() != Fault::timeout && !was_heard(pdu.error());
        if (is_outdated(planned))
            schedule_.retry_at(read, now + (not_sent ? kRereadUnsent : kRereadAfterFailure));
    }
    return planned.wants;
}

std::vector<std::size_t> StationPolls::on_write(TimePoint now,
                                                const std::optional<modbus::Span>& items) {
    std::vector<std::size_t> outdated;
    for (std::size_t i = 0; i < wants_.size(); ++i) {
        Reading& reading = readings_[i];
        if (!may_change(memory_, items, wants_[i].span)) continue;
        const bool was_outdated = reading.outdated();
        reading.written = now;
        if (!was_outdated && reading.outdated()) outdated.push_back(i);
    }
    return outdated;
}

void StationPolls::on_written(TimePoint now, const std::optional<modbus::Span>& items) {
    for (const bool own_items : {true, false}) {
        for (std::size_t i = 0; i < plan_.size(); ++i) {
            const modbus::Span& span = plan_[i].span;
            const bool direct = items && items->overlaps(span);
            if (direct != own_items || leaves_unchanged(memory_, items, span)) continue;
            if (is_outdated(plan_[i]) || !may_change(memory_, items, span))
                schedule_.request_extra_turn(i, now);
        }
    }
}

bool may_change(const SharedMemory& memory, const std::optional<modbus::Span>& written,
                const modbus::Span& items) {
    const auto known = written ? memory.changes(*written, items) : std::nullopt;
    return known ? *known : modbus::may_change(written, items);
}

bool leaves_unchanged(const SharedMemory& memory, const std::optional<modbus::Span>& written,
                      const modbus::Span& items) {
    return memory.known ? !may_change(memory, written, items) : !modbus::may_change(written, items);
}

bool StationPolls::is_outdated(const PlannedRead& read) const {
    return std::ranges::any_of(read.wants,
                               [&](std::size_t want) { return readings_[want].outdated(); });
}

/// Returns false if the reply holds fewer items than requested; no bus returns that.
bool StationPolls::store(const PlannedRead& read, ByteView reply, TimePoint sampled) {
    const std::vector<std::uint16_t> items = items_of(read.span, reply);
    if (items.size() < read.span.count) return false;
    for (const std::size_t index : read.wants) {
        const modbus::Span& want = wants_[index].span;
        Reading& reading = readings_[index];
        reading.values.resize(want.count);
        const std::uint32_t first = std::max(want.first, read.span.first);
        const std::uint32_t end = std::min(want.end(), read.span.end());
        for (std::uint32_t i = first; i < end; ++i)
            reading.values[i - want.first] = items[i - read.span.first];
        reading.failing = false;
        reading.exception.reset();
        ++reading.good;
        const auto pieces = pieces_.find(index);
        if (pieces == pieces_.end()) {
            reading.sampled = sampled;
            continue;
        }
        pieces->second[first] = sampled;
        std::size_t needed = 0;
        for (const PlannedRead& other : plan_)
            needed += std::ranges::count(other.wants, index) > 0 ? 1u : 0u;
        if (pieces->second.size() < needed) continue;
        const auto oldest =
            std::ranges::min_element(pieces->second, {}, [](const auto& p) { return p.second; });
        reading.sampled = oldest->second;
    }
    return true;
}

void StationPolls::fail(const PlannedRead& read, std::optional<std::uint8_t> exception) {
    for (const std::size_t index : read.wants) {
        readings_[index].failing = true;
        readings_[index].exception = exception;
        ++readings_[index].failed;
    }
}

/// Returns false if this read is for one want only.
bool StationPolls::split(TimePoint now, std::size_t read) {
    auto halves = bisect(plan_[read], wants_);
    if (!halves) return false;
    plan_[read] = std::move(halves->first);
    plan_.push_back(std::move(halves->second));
    schedule_ = schedule_of(plan_, now);
    return true;
}

}  // namespace panelgate::points
