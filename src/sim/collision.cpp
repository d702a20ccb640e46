#include "panelgate/sim/collision.hpp"

#include <algorithm>
#include <bit>

namespace panelgate::sim {
namespace {

std::size_t data_bits(const SerialFormat& format) {
    return static_cast<std::size_t>(format.data_bits);
}

/// The levels of one character: start bit 0, data from the least significant bit, parity, stop 1.
void append_character(std::vector<bool>& levels, std::uint8_t byte, const SerialFormat& format) {
    levels.push_back(false);
    for (std::size_t i = 0; i < data_bits(format); ++i) levels.push_back((byte >> i & 1) != 0);
    const bool odd_ones = std::popcount(byte) % 2 != 0;
    if (format.parity == Parity::even) levels.push_back(odd_ones);
    if (format.parity == Parity::odd) levels.push_back(!odd_ones);
    levels.insert(levels.end(), static_cast<std::size_t>(format.stop_bits), true);
}

std::vector<bool> levels_of(ByteView bytes, std::size_t idle, const SerialFormat& format) {
    std::vector<bool> levels(idle, true);
    for (const std::uint8_t byte : bytes) append_character(levels, byte, format);
    return levels;
}

}  // namespace

HeardBytes collide(ByteView first, ByteView second, std::size_t later, const SerialFormat& format) {
    std::vector<bool> line = levels_of(first, 0, format);
    const std::vector<bool> other = levels_of(second, later, format);
    line.resize(std::max(line.size(), other.size()), true);
    for (std::size_t i = 0; i < other.size(); ++i) line[i] = line[i] && other[i];
    const auto character = static_cast<std::size_t>(format.bits_per_character());
    line.resize(line.size() + character, true);  // the last character may begin late
    HeardBytes heard;
    for (std::size_t at = 0; at + character <= line.size();) {
        if (line[at]) {
            ++at;
            continue;
        }
        unsigned byte = 0;
        for (std::size_t i = 0; i < data_bits(format); ++i)
            byte |= (line[at + 1 + i] ? 1u : 0u) << i;
        heard.bytes.push_back(static_cast<std::uint8_t>(byte));
        heard.ends.push_back(static_cast<std::uint32_t>(at + character));
        // A stop bit of 0 starts one.
        at += 1 + data_bits(format) + (format.parity == Parity::none ? 0 : 1);
    }
    return heard;
}

}  // namespace panelgate::sim
