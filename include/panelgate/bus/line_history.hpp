#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/counters.hpp"

namespace panelgate::bus {

/// Busy share of a line over the last ten whole seconds, or since the start if that is less.
/// Independent of how often it is read. Pure.
class LoadMeter {
  public:
    explicit LoadMeter(TimePoint start) : start_(start) {}

    /// `busy`: total busy time, never decreasing. The increase counts as one interval ending now.
    void record(TimePoint now, Duration busy);
    /// Returns 0..100.
    double percent(TimePoint now) const;

  private:
    static constexpr std::int64_t kSeconds = 10;

    std::int64_t second_of(TimePoint at) const { return (at - start_) / 1s; }
    Duration& of(std::int64_t second) {
        return seconds_[static_cast<std::size_t>(second) % seconds_.size()];
    }
    void advance_to(std::int64_t second);

    TimePoint start_;
    Duration known_{};
    std::int64_t newest_ = 0;                       ///< newest second in the ring, since the start
    std::array<Duration, kSeconds + 1> seconds_{};  ///< busy time per second
};

/// What came of the requests to a station or a line: so far, or between two times.
struct RequestCounts {
    std::uint64_t requests = 0;  ///< answered, by a panel or not
    std::uint64_t errors = 0;    ///< of these: exceptions, faults, refusals
    std::uint64_t no_turn = 0;   ///< of the errors: the queue was full, or its deadline came first
    std::uint64_t answers = 0;   ///< with a latency
    double latency = 0;          ///< from arrival to answer, their sum in seconds
    std::uint64_t transactions = 0;
    double wire = 0;  ///< from first bit out to last bit in, their sum in seconds

    RequestCounts& operator+=(const RequestCounts& more);
};
RequestCounts counts_of(const StationReport& station);
/// Counters that have begun anew, so that one is smaller than before, count from zero.
RequestCounts difference(const RequestCounts& now, const RequestCounts& before);

/// A line's figures for one time slot.
struct LineSample {
    TimePoint at;                        ///< start of the slot
    std::optional<double> load_percent;  ///< 0..100; nullopt while the line was down
    std::uint64_t requests = 0;          ///< answered requests
    std::uint64_t errors = 0;            ///< of these: exceptions, faults, refusals
    std::optional<double>
        latency_ms;                 ///< mean time from arrival to answer; nullopt without a request
    std::optional<double> wire_ms;  ///< mean time from first bit out to last bit in
    std::size_t queue_depth = 0;    ///< at the end of the slot
};

/// A line's figures for the last hour. Memory is fixed: kColumns values of eight bytes per time
/// slot, 34 kB with slots of 5 s, and the last counts of each station. Pure.
class LineHistory {
  public:
    static constexpr Duration kSpan = 1h;
    static constexpr Duration kNarrowest = 5s;
    static constexpr std::size_t kColumns = 6;

    explicit LineHistory(Duration width);

    /// Call once per slot: records what happened since the last call. The first call only sets the
    /// start. A station that is new, or whose counters have begun anew, counts from zero.
    void record(TimePoint now, const LineReport& report);
    /// Returns the slots, oldest first.
    std::vector<LineSample> samples(TimePoint now) const;
    Duration width() const { return width_; }

  private:
    enum Column : std::size_t { kLoad, kRequests, kErrors, kLatency, kWire, kQueue };

    void put(Column column, TimePoint at, const std::optional<double>& value) {
        if (value) rings_.put(column, at, *value);
    }
    /// The counts of all stations since the last call.
    RequestCounts take(const LineReport& report);

    std::optional<TimePoint> at_;  ///< of the last call
    Duration busy_{};
    std::map<std::string, RequestCounts, std::less<>> stations_;
    Duration width_;
    SlotRings rings_;
};

}  // namespace panelgate::bus
