#pragma once

#include <array>
#include <cstdint>

#include "panelgate/base/time.hpp"

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

}  // namespace panelgate::bus
