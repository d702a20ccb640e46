#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace panelgate::mqtt {

struct Counters {
    bool connected = false;
    std::size_t stored = 0;             ///< changes that the broker has not acknowledged
    std::uint64_t published = 0;        ///< messages sent to the broker, repetitions included
    std::uint64_t dropped = 0;          ///< changes lost because the store was full
    std::uint64_t reconnects = 0;       ///< connections after the first
    std::uint64_t writes_ok = 0;        ///< successful point writes through the broker
    std::uint64_t writes_refused = 0;   ///< ... refused before reaching a panel
    std::uint64_t writes_failed = 0;    ///< ... refused or not confirmed by the panel
    std::uint64_t results_dropped = 0;  ///< write results lost because the queue was full
    std::string broker{};
    /// End of the gateway's own certificate, in seconds since 1970; 0: it has none.
    std::int64_t certificate_expiry = 0;
};

}  // namespace panelgate::mqtt
