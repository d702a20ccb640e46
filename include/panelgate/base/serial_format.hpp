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

/// What a frame is made of (serial line V1.02, 2.5).
enum class SerialMode : std::uint8_t {
    rtu,   ///< its bytes, ended by silence
    ascii  ///< ':', two hex digits a byte, LRC, CR LF
};
/// As configuration and profiles write them.
inline constexpr std::array<std::pair<std::string_view, SerialMode>, 2> kSerialModeWords{
    {{"rtu", SerialMode::rtu}, {"ascii", SerialMode::ascii}}};

/// How characters look on a line, and what is said with them. The default is the standard's: RTU at
/// 19200 8E1 (serial line V1.02, 2.5.1).
struct SerialFormat {
    int baud = 19200;  ///< bit/s, above 0
    int data_bits = 8;
    Parity parity = Parity::even;
    int stop_bits = 1;
    SerialMode mode = SerialMode::rtu;

    /// Start, data, parity and stop bits: 9 to 12.
    int bits_per_character() const {
        return 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
    }
    friend bool operator==(const SerialFormat&, const SerialFormat&) = default;
};

/// "38400 8N1", "9600 7E1 ASCII"
std::string to_string(const SerialFormat& format);

/// Time of one character.
Duration character_time(const SerialFormat& format);
/// Time of n characters without pauses.
Duration wire_time(const SerialFormat& format, std::size_t characters);
/// Time of a frame that has so many bytes in RTU, address to CRC; or of several, that have so many
/// together. In ASCII a frame is ':', two characters a byte with the LRC for the CRC, and CR LF.
Duration frame_time(const SerialFormat& format, std::size_t bytes, std::size_t frames = 1);
/// What each further byte adds to that.
Duration byte_time(const SerialFormat& format);
/// Behind each frame, before the next one. RTU: t3.5, 3.5 characters up to 19200 bit/s, the fixed
/// 1.750 ms above (serial line V1.02, 2.5.1.1). ASCII needs none: two characters, 1 ms at least, in
/// which transceivers turn round.
Duration silent_interval(const SerialFormat& format);

}  // namespace panelgate
