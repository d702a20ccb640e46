#pragma once

#include <cstdint>

#include "panelgate/base/time.hpp"

namespace panelgate::scenario {

/// SplitMix64: small, fast, the same everywhere, so that a seed replays on any machine.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        state_ += 0x9E3779B97F4A7C15u;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        return z ^ (z >> 31);
    }
    /// 0..n-1
    unsigned below(unsigned n) { return static_cast<unsigned>(next() % n); }
    unsigned between(unsigned low, unsigned high) { return low + below(high - low + 1); }
    double share() { return static_cast<double>(next() >> 11) * 0x1p-53; }
    bool chance(double p) { return share() < p; }
    Duration between(Duration low, Duration high) {
        return low + Duration(static_cast<Duration::rep>(
                         share() * static_cast<double>((high - low).count())));
    }

  private:
    std::uint64_t state_;
};

}  // namespace panelgate::scenario
