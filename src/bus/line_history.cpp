#include "panelgate/bus/line_history.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace panelgate::bus {

/// Seconds before the ring's range count as idle.
void LoadMeter::advance_to(std::int64_t second) {
    const std::int64_t first = std::max(newest_ + 1, second - kSeconds);
    for (std::int64_t next = first; next <= second; ++next) of(next) = {};
    newest_ = std::max(newest_, second);
}

void LoadMeter::record(TimePoint now, Duration busy) {
    Duration added = busy - known_;
    if (added <= Duration::zero()) return;
    known_ = busy;
    advance_to(second_of(now));
    const std::int64_t oldest = std::max<std::int64_t>(newest_ - kSeconds, 0);
    TimePoint end = now;
    for (std::int64_t second = newest_; second >= oldest && added > Duration::zero(); --second) {
        const Duration here = std::min(added, end - (start_ + second * 1s));
        of(second) += here;
        added -= here;
        end -= here;
    }
}

double LoadMeter::percent(TimePoint now) const {
    const std::int64_t second = second_of(now);
    if (second == 0) {  // no whole second yet
        const Duration span = now - start_;
        if (span <= Duration::zero()) return 0;
        return std::min(100.0, 100.0 * to_seconds(seconds_[0]) / to_seconds(span));
    }
    const std::int64_t first = std::max<std::int64_t>(second - kSeconds, 0);
    Duration busy{};
    for (std::int64_t one = std::max(first, newest_ - kSeconds); one < second && one <= newest_;
         ++one) {
        busy += seconds_[static_cast<std::size_t>(one) % seconds_.size()];
    }
    return std::min(100.0, 100.0 * to_seconds(busy) / static_cast<double>(second - first));
}

namespace {

std::uint64_t count_of(const Histogram& all) {
    return std::accumulate(all.counts.begin(), all.counts.end(), std::uint64_t{0});
}

/// Returns milliseconds; nullopt if nothing was observed.
std::optional<double> mean(double seconds, std::uint64_t count) {
    if (count == 0) return std::nullopt;
    return std::max(0.0, seconds) * 1000 / static_cast<double>(count);
}

bool is_error(Outcome outcome) {
    return outcome != Outcome::ok && outcome != Outcome::cached && outcome != Outcome::shared;
}

}  // namespace

LineHistory::LineHistory(Duration width)
    : width_(width), rings_(width, slots_of(kSpan, width), kColumns) {}

RequestCounts& RequestCounts::operator+=(const RequestCounts& more) {
    requests += more.requests;
    errors += more.errors;
    no_turn += more.no_turn;
    answers += more.answers;
    latency += more.latency;
    transactions += more.transactions;
    wire += more.wire;
    return *this;
}

RequestCounts counts_of(const StationReport& station) {
    RequestCounts counts;
    for (const auto& [function, outcomes] : station.requests) {
        for (const Outcome outcome : kAllOutcomes) {
            counts.requests += outcomes[outcome];
            if (is_error(outcome)) counts.errors += outcomes[outcome];
        }
        counts.no_turn += outcomes[Outcome::busy] + outcomes[Outcome::expired];
    }
    counts.answers = count_of(station.request_duration);
    counts.latency = station.request_duration.sum;
    counts.transactions = count_of(station.wire.bus_transaction);
    counts.wire = station.wire.bus_transaction.sum;
    return counts;
}

RequestCounts difference(const RequestCounts& now, const RequestCounts& before) {
    const bool is_new = now.requests < before.requests || now.errors < before.errors ||
                        now.answers < before.answers || now.transactions < before.transactions;
    if (is_new) return now;
    return {now.requests - before.requests, now.errors - before.errors,
            now.no_turn - before.no_turn,   now.answers - before.answers,
            now.latency - before.latency,   now.transactions - before.transactions,
            now.wire - before.wire};
}

RequestCounts LineHistory::take(const LineReport& report) {
    RequestCounts sum;
    const auto before = std::exchange(stations_, {});
    for (const StationReport& station : report.stations) {
        const RequestCounts now = counts_of(station);
        const auto known = before.find(station.station);
        sum += difference(now, known == before.end() ? RequestCounts() : known->second);
        stations_.emplace(station.station, now);
    }
    return sum;
}

void LineHistory::record(TimePoint now, const LineReport& report) {
    const RequestCounts counts = take(report);
    const Duration busy = report.wire.busy - std::exchange(busy_, report.wire.busy);
    const std::optional<TimePoint> before = std::exchange(at_, now);
    if (!before || now <= *before) return;
    const double share = to_seconds(busy) / to_seconds(now - *before);
    if (report.up) put(kLoad, *before, std::clamp(share * 100, 0.0, 100.0));
    put(kRequests, *before, static_cast<double>(counts.requests));
    put(kErrors, *before, static_cast<double>(counts.errors));
    put(kLatency, *before, mean(counts.latency, counts.answers));
    put(kWire, *before, mean(counts.wire, counts.transactions));
    put(kQueue, *before, static_cast<double>(report.queue_depth));
}

std::vector<LineSample> LineHistory::samples(TimePoint now) const {
    std::vector<LineSample> samples;
    rings_.each(kRequests, now, [&](TimePoint at, double requests) {
        LineSample sample;
        sample.at = at;
        sample.load_percent = rings_.at(kLoad, at);
        sample.requests = static_cast<std::uint64_t>(requests);
        sample.errors = static_cast<std::uint64_t>(rings_.at(kErrors, at).value_or(0));
        sample.latency_ms = rings_.at(kLatency, at);
        sample.wire_ms = rings_.at(kWire, at);
        sample.queue_depth = static_cast<std::size_t>(rings_.at(kQueue, at).value_or(0));
        samples.push_back(sample);
    });
    return samples;
}

}  // namespace panelgate::bus
