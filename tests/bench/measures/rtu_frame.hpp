#pragma once

// For the programs of this folder, which share nothing with the gateway that they measure.
#include <cstdint>
#include <vector>

using Bytes = std::vector<std::uint8_t>;

// The CRC of RTU frames, low byte first (Modbus over serial line 1.02, 2.5.1.2).
inline void append_crc(Bytes& frame) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t byte : frame) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1;
    }
    frame.push_back(static_cast<std::uint8_t>(crc));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
}
