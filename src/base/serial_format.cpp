#include "panelgate/base/serial_format.hpp"

#include <algorithm>

namespace panelgate {

std::string to_string(Parity parity) {
    const auto* word =
        std::ranges::find(kParityWords, parity, [](const auto& w) { return w.second; });
    return std::string(word->first);
}

std::string to_string(const SerialFormat& format) {
    if (format.baud == SerialFormat::kNoWire) return "Modbus/TCP";
    const char parity = format.parity == Parity::none   ? 'N'
                        : format.parity == Parity::even ? 'E'
                                                        : 'O';
    return std::to_string(format.baud) + ' ' + std::to_string(format.data_bits) + parity +
           std::to_string(format.stop_bits) + (format.mode == SerialMode::ascii ? " ASCII" : "");
}

Duration character_time(const SerialFormat& format) { return wire_time(format, 1); }

Duration wire_time(const SerialFormat& format, std::size_t characters) {
    const auto bits = static_cast<std::int64_t>(characters) * format.bits_per_character();
    return Duration(bits * 1'000'000'000 / format.baud);
}

Duration frame_time(const SerialFormat& format, std::size_t bytes, std::size_t frames) {
    return wire_time(format, format.mode == SerialMode::ascii ? 2 * bytes + frames : bytes);
}

Duration byte_time(const SerialFormat& format) {
    return wire_time(format, format.mode == SerialMode::ascii ? 2 : 1);
}

Duration silent_interval(const SerialFormat& format) {
    if (format.baud == SerialFormat::kNoWire) return Duration::zero();
    if (format.mode == SerialMode::ascii) return std::max<Duration>(wire_time(format, 2), 1ms);
    constexpr int kFixedAbove = 19200;
    if (format.baud > kFixedAbove) return 1750us;
    return Duration(std::int64_t{35} * format.bits_per_character() * 100'000'000 / format.baud);
}

}  // namespace panelgate
