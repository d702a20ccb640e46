#include "frame.hpp"

#include <ctime>

namespace zoo {

Time now() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return static_cast<Time>(t.tv_sec) * kSecond + t.tv_nsec;
}

std::uint16_t crc16(const std::uint8_t* data, std::size_t size) {
    unsigned value = 0xFFFF;
    for (std::size_t i = 0; i < size; ++i) {
        value ^= data[i];
        for (int bit = 0; bit < 8; ++bit) {
            value = (value & 1U) != 0 ? (value >> 1U) ^ 0xA001U : value >> 1U;
        }
    }
    return static_cast<std::uint16_t>(value);
}

Bytes sealed(int unit, const Bytes& pdu, bool swapped) {
    Bytes frame{static_cast<std::uint8_t>(unit)};
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const unsigned crc = crc16(frame.data(), frame.size());
    const auto low = static_cast<std::uint8_t>(crc & 0xFFU);
    const auto high = static_cast<std::uint8_t>(crc >> 8U);
    frame.push_back(swapped ? high : low);
    frame.push_back(swapped ? low : high);
    return frame;
}

bool has_good_crc(const Bytes& frame, bool swapped) {
    if (frame.size() < 4) return false;
    const Bytes pdu(frame.begin() + 1, frame.end() - 2);
    return frame == sealed(frame[0], pdu, swapped);
}

std::size_t request_length(const Bytes& data) {
    if (data.size() < 2) return 0;
    switch (data[1]) {
        case 1:
        case 2:
        case 3:
        case 4:
        case 5:
        case 6:
        case 8:
            return 8;
        case 7:
        case 11:
        case 12:
        case 17:
            return 4;
        case 15:
        case 16:
            return data.size() < 7 ? 0 : 9U + data[6];
        case 22:
            return 10;
        case 23:
            return data.size() < 11 ? 0 : 13U + data[10];
        case 24:
            return 6;
        case 43:
            return 7;
        default:
            return 0;
    }
}

std::uint32_t Dice::next() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 17U;
    state_ ^= state_ << 5U;
    return state_;
}

Time Dice::between(Time low, Time high) {
    if (high <= low) return low;
    const double share = static_cast<double>(next()) / 4294967296.0;
    return low + static_cast<Time>(share * static_cast<double>(high - low + 1));
}

}  // namespace zoo
