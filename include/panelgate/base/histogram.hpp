#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "panelgate/base/time.hpp"

namespace panelgate {

/// Counts durations in fixed buckets (upper bounds in seconds, Prometheus style).
struct Histogram {
    static constexpr std::array<double, 14> kBounds = {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1,
                                                       0.2,   0.5,   1.0,   2.0,  5.0,  10.0, 30.0};

    void observe(Duration d) {
        const double seconds = to_seconds(d);
        std::size_t i = 0;
        while (i < kBounds.size() && seconds > kBounds[i]) ++i;
        ++counts[i];
        sum += seconds;
    }

    std::array<std::uint64_t, kBounds.size() + 1> counts{};  ///< not cumulative; the last is +Inf
    double sum = 0;
};

}  // namespace panelgate
