#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/counters.hpp"

namespace panelgate::bus {

/// The busy share of a line over the last ten whole seconds, or since the start when that is less:
/// one figure, whoever asks, and however often. Pure.
class LoadMeter {
  public:
    explicit LoadMeter(TimePoint start) : start_(start) {}

    /// `busy` only grows. What is new of it is taken to have ended now, in one piece.
    void record(TimePoint now, Duration busy);
    /// 0..100.
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
    std::int64_t newest_ = 0;  ///< the last second since the start that the ring holds
    std::array<Duration, kSeconds + 1> seconds_{};  ///< the busy time of each
};

/// The figures of a line over one slot of time.
struct LineSample {
    TimePoint at;                        ///< the slot begins
    std::optional<double> load_percent;  ///< 0..100; nothing while the line was down
    std::uint64_t requests = 0;          ///< that were answered
    std::uint64_t errors = 0;            ///< of these: panels' exceptions, faults, refusals
    std::optional<double> latency_ms;    ///< arrival to answer, mean; nothing without a request
    std::optional<double> wire_ms;       ///< first bit out to last bit in, mean of the answered
    std::size_t queue_depth = 0;         ///< at its end
};

/// The last hour of a line's figures. Memory is fixed: kColumns slots of eight bytes for each slot
/// of time, 34 kB with those of 5 s. Pure.
class LineHistory {
  public:
    static constexpr Duration kSpan = 1h;
    static constexpr Duration kNarrowest = 5s;
    static constexpr std::size_t kColumns = 6;

    explicit LineHistory(Duration width);

    /// Once a slot: what has happened since the last call. The first only begins.
    void record(TimePoint now, const LineReport& report);
    /// The oldest first.
    std::vector<LineSample> samples(TimePoint now) const;
    Duration width() const { return width_; }

  private:
    /// What only grows.
    struct Totals {
        TimePoint at;
        Duration busy{};
        std::uint64_t requests = 0;
        std::uint64_t errors = 0;
        Histogram latency;
        Histogram wire;
    };
    static Totals totals_of(TimePoint now, const LineReport& report);

    Duration width_;
    std::optional<Totals> before_;
    SlotRing load_, requests_, errors_, latency_, wire_, queue_;
};

}  // namespace panelgate::bus
