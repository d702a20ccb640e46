#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace panelgate::points {

/// One point as exported at a scrape.
struct PointSample {
    std::string line;
    std::string station;
    std::string point;
    std::string unit;
    std::optional<double> value;  ///< nullopt if the last read failed
    std::optional<double> age;    ///< seconds; nullopt if never read
};

/// One relay as exported at a scrape.
struct RelaySample {
    std::string relay;
    bool ok = false;  ///< the last transfer succeeded
    std::uint64_t reads = 0;
    std::uint64_t writes = 0;
    std::uint64_t repairs = 0;  ///< of these: after another client had written there
    std::uint64_t read_failures = 0;
    std::uint64_t write_failures = 0;
};

}  // namespace panelgate::points
