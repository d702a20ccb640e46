#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/time.hpp"

namespace panelgate {

enum class Parity : std::uint8_t { none, even, odd };
/// The words of configuration, profiles and command line.
inline constexpr std::array<std::pair<std::string_view, Parity>, 3> kParityWords{
    {{"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}}};
std::string to_string(Parity parity);

/// Transmission mode (serial line V1.02, 2.5).
enum class SerialMode : std::uint8_t {
    rtu,   ///< binary bytes; silence ends the frame
    ascii  ///< ':', two hex digits per byte, LRC, CR LF
};
/// The words of configuration and profiles.
inline constexpr std::array<std::pair<std::string_view, SerialMode>, 2> kSerialModeWords{
    {{"rtu", SerialMode::rtu}, {"ascii", SerialMode::ascii}}};

/// Character format and transmission mode of a line. The default is the standard's: RTU at 19200
/// 8E1 (serial line V1.02, 2.5.1).
struct SerialFormat {
    /// Rate of a device on Ethernet, whose frames take no time that counts.
    static constexpr int kNoWire = 1'000'000'000;

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

/// Formats "38400 8N1", "9600 7E1 ASCII"; "Modbus/TCP" without a wire.
std::string to_string(const SerialFormat& format);

/// Transmission time of one character.
Duration character_time(const SerialFormat& format);
/// Transmission time of n characters without gaps.
Duration wire_time(const SerialFormat& format, std::size_t characters);
/// Transmission time of `frames` frames that have `bytes` bytes in RTU in total, address to CRC. In
/// ASCII a frame is ':', two characters per byte with the LRC for the CRC, and CR LF.
Duration frame_time(const SerialFormat& format, std::size_t bytes, std::size_t frames = 1);
/// Time that each further byte adds to frame_time().
Duration byte_time(const SerialFormat& format);
/// Silence after each frame. RTU: t3.5, 3.5 characters up to 19200 bit/s, the fixed 1.750 ms above
/// (serial line V1.02, 2.5.1.1). ASCII needs none: two characters, at least 1 ms, in which
/// transceivers turn round.
Duration silent_interval(const SerialFormat& format);

}  // namespace panelgate
