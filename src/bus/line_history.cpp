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

void add(Histogram& all, const Histogram& one) {
    for (std::size_t i = 0; i < all.counts.size(); ++i) all.counts[i] += one.counts[i];
    all.sum += one.sum;
}

std::uint64_t count_of(const Histogram& all) {
    return std::accumulate(all.counts.begin(), all.counts.end(), std::uint64_t{0});
}

/// Returns milliseconds; nullopt if nothing was observed in between.
std::optional<double> mean(const Histogram& before, const Histogram& now) {
    const std::uint64_t count = count_of(now) - count_of(before);
    if (count == 0) return std::nullopt;
    return std::max(0.0, now.sum - before.sum) * 1000 / static_cast<double>(count);
}

bool is_error(Outcome outcome) {
    return outcome != Outcome::ok && outcome != Outcome::cached && outcome != Outcome::shared;
}

void put(SlotRing& ring, TimePoint at, const std::optional<double>& value) {
    if (value) ring.put(at, *value);
}

}  // namespace

LineHistory::LineHistory(Duration width)
    : width_(width),
      load_(width, slots_of(kSpan, width)),
      requests_(load_),
      errors_(load_),
      latency_(load_),
      wire_(load_),
      queue_(load_) {}

LineHistory::Totals LineHistory::totals_of(TimePoint now, const LineReport& report) {
    Totals totals;
    totals.at = now;
    totals.busy = report.wire.busy;
    for (const StationReport& station : report.stations) {
        for (const auto& [function, counts] : station.requests) {
            for (const Outcome outcome : kAllOutcomes) {
                totals.requests += counts[outcome];
                if (is_error(outcome)) totals.errors += counts[outcome];
            }
        }
        add(totals.latency, station.request_duration);
        add(totals.wire, station.wire.bus_transaction);
    }
    return totals;
}

void LineHistory::record(TimePoint now, const LineReport& report) {
    const Totals totals = totals_of(now, report);
    const std::optional<Totals> before = std::exchange(before_, totals);
    if (!before || now <= before->at) return;
    const TimePoint at = before->at;
    const double share = to_seconds(totals.busy - before->busy) / to_seconds(now - at);
    if (report.up) load_.put(at, std::clamp(share * 100, 0.0, 100.0));
    requests_.put(at, static_cast<double>(totals.requests - before->requests));
    errors_.put(at, static_cast<double>(totals.errors - before->errors));
    put(latency_, at, mean(before->latency, totals.latency));
    put(wire_, at, mean(before->wire, totals.wire));
    queue_.put(at, static_cast<double>(report.queue_depth));
}

std::vector<LineSample> LineHistory::samples(TimePoint now) const {
    std::vector<LineSample> samples;
    requests_.each(now, [&](TimePoint at, double requests) {
        LineSample sample;
        sample.at = at;
        sample.load_percent = load_.at(at);
        sample.requests = static_cast<std::uint64_t>(requests);
        sample.errors = static_cast<std::uint64_t>(errors_.at(at).value_or(0));
        sample.latency_ms = latency_.at(at);
        sample.wire_ms = wire_.at(at);
        sample.queue_depth = static_cast<std::size_t>(queue_.at(at).value_or(0));
        samples.push_back(sample);
    });
    return samples;
}

}  // namespace panelgate::bus
