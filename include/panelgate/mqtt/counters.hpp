#pragma once

#include <cstddef>
#include <cstdint>

namespace panelgate::mqtt {

struct Counters {
    bool connected = false;
    std::size_t stored = 0;             ///< changes that the broker has not acknowledged
    std::uint64_t published = 0;        ///< messages handed to the broker, repetitions included
    std::uint64_t dropped = 0;          ///< changes that found no room while the broker was away
    std::uint64_t reconnects = 0;       ///< connections after the first
    std::uint64_t writes_ok = 0;        ///< writes of points that came by the broker
    std::uint64_t writes_refused = 0;   ///< ... that nobody was asked for
    std::uint64_t writes_failed = 0;    ///< ... that the panel refused, or did not confirm
    std::uint64_t results_dropped = 0;  ///< answers to writes that found no room
};

}  // namespace panelgate::mqtt
