#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scenario {

/// A frame as it stands on this line.
inline Bytes spoken(const SerialFormat& serial, std::uint8_t station, ByteView pdu,
                    modbus::CrcOrder order = modbus::CrcOrder::low_first) {
    if (serial.mode == SerialMode::ascii) return modbus::encode_ascii(station, pdu);
    return modbus::encode_adu(station, pdu, order);
}

/// What stands on this line, as RTU says it.
inline Bytes understood(const SerialFormat& serial, ByteView wire) {
    if (serial.mode == SerialMode::rtu) return {wire.begin(), wire.end()};
    modbus::AsciiTranscript transcript(modbus::HexDigits::upper_only);
    transcript.feed({}, wire);
    Bytes all;
    while (const auto piece = transcript.next())
        all.insert(all.end(), piece->bytes.begin(), piece->bytes.end());
    return all;
}

}  // namespace panelgate::scenario
