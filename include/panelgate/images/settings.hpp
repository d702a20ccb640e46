#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace panelgate::images {

/// A point of an image, or items that are left free.
struct Entry {
    std::string station{};  ///< its name; "": free registers
    std::string point{};
    std::uint32_t skip = 0;  ///< free registers
    friend bool operator==(const Entry&, const Entry&) = default;
};

/// What a read gets that touches a point without a good value.
enum class Stale : std::uint8_t {
    exception,  ///< 0B
    last        ///< the last value; 0B only where no value was ever read and no quality is shown
};

/// Points of many stations as one virtual unit.
struct Settings {
    static constexpr std::size_t kMost = 64;  ///< images of a configuration

    std::string name;  ///< unique
    std::uint8_t unit = 1;
    std::vector<Entry> entries;
    Stale stale = Stale::exception;
    bool quality = false;  ///< an item behind each point tells its quality
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::images
