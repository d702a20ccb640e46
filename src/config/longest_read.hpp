#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// One read of a station, and how many bytes of values answer it.
struct Read {
    std::string what;
    std::size_t count = 0;
    bool bits = false;
    Duration response_timeout{};

    std::size_t bytes() const { return bits ? (count + 7) / 8 : 2 * count; }
    /// Nothing but the two frames: no read is quicker.
    Duration on_wire(const SerialFormat& serial) const;
};

/// Of the poll blocks.
std::optional<Read> longest_poll(const Line& line);
/// What a client may ask of any station.
std::optional<Read> longest_read(const Line& line);
/// How many items a read may have whose two frames take less than `within`; 0 = none can.
std::size_t most_items(const SerialFormat& serial, bool bits, Duration within);

}  // namespace panelgate::config
