#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate {

enum class Parity : std::uint8_t { none, even, odd };
/// As configuration, profiles and command line write it.
inline constexpr std::array<std::pair<std::string_view, Parity>, 3> kParityWords{
    {{"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}}};
std::string to_string(Parity parity);

/// How characters look on a line. The default is the standard's: 19200 8E1 (serial line
/// V1.02, 2.5.1).
struct SerialFormat {
    int baud = 19200;  ///< bit/s, above 0
    int data_bits = 8;
    Parity parity = Parity::even;
    int stop_bits = 1;

    /// Start, data, parity and stop bits: 10 or 11 for what RTU allows.
    int bits_per_character() const {
        return 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
    }
    friend bool operator==(const SerialFormat&, const SerialFormat&) = default;
};

/// "38400 8N1"
std::string to_string(const SerialFormat& format);

/// Time of one character.
Duration character_time(const SerialFormat& format);
/// Time of n characters without pauses.
Duration wire_time(const SerialFormat& format, std::size_t characters);
/// t3.5: 3.5 characters up to 19200 bit/s, the fixed 1.750 ms above (serial line V1.02, 2.5.1.1).
Duration silent_interval(const SerialFormat& format);

}  // namespace panelgate
