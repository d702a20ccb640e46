#include "panel.hpp"

#include <cstddef>

namespace zoo {
namespace {

int word(const Bytes& pdu, std::size_t at) { return pdu[at] << 8 | pdu[at + 1]; }

Bytes refusal(const Bytes& pdu, int code) {
    return {static_cast<std::uint8_t>(pdu[0] | 0x80), static_cast<std::uint8_t>(code)};
}

bool parity(unsigned value) { return __builtin_parity(value) != 0; }

}  // namespace

std::uint16_t Panel::holding(int address) const {
    if (address == kServedRegister) return static_cast<std::uint16_t>(served_.answered);
    if (address == kAskedRegister) return static_cast<std::uint16_t>(served_.asked);
    const auto written = registers_.find(address);
    if (written != registers_.end()) return written->second;
    return static_cast<std::uint16_t>(unit_ * 257 + address * 31 + 7);
}

std::uint16_t Panel::input(int address) const {
    return static_cast<std::uint16_t>(unit_ * 263 + address * 37 + 11);
}

bool Panel::coil(int address) const {
    const auto written = coils_.find(address);
    return written != coils_.end() ? written->second
                                   : parity(static_cast<unsigned>(unit_ * 5 + address * 3));
}

bool Panel::discrete(int address) const {
    return parity(static_cast<unsigned>(unit_ * 7 + address * 5));
}

Bytes Panel::execute(const Bytes& pdu) {
    switch (pdu[0]) {
        case 1:
        case 2:
            return read_bits(pdu);
        case 3:
        case 4:
            return read_registers(pdu);
        case 5:
        case 6:
            return write_one(pdu);
        case 15:
        case 16:
            return write_many(pdu);
        default:
            return refusal(pdu, 1);
    }
}

Bytes Panel::read_bits(const Bytes& pdu) const {
    const int address = word(pdu, 1);
    const int count = word(pdu, 3);
    if (count < 1 || count > 2000) return refusal(pdu, 3);
    if (address + count > kEnd) return refusal(pdu, 2);
    const auto size = static_cast<std::size_t>((count + 7) / 8);
    Bytes reply{pdu[0], static_cast<std::uint8_t>(size)};
    reply.resize(2 + size);
    for (int i = 0; i < count; ++i) {
        const bool on = pdu[0] == 1 ? coil(address + i) : discrete(address + i);
        auto& byte = reply[2 + static_cast<std::size_t>(i) / 8];
        byte = static_cast<std::uint8_t>(byte | (on ? 1 << i % 8 : 0));
    }
    return reply;
}

Bytes Panel::read_registers(const Bytes& pdu) const {
    const int address = word(pdu, 1);
    const int count = word(pdu, 3);
    if (count < 1 || count > 125) return refusal(pdu, 3);
    if (address + count > kEnd) return refusal(pdu, 2);
    Bytes reply{pdu[0], static_cast<std::uint8_t>(2 * count)};
    for (int i = address; i < address + count; ++i) {
        const int value = pdu[0] == 3 ? holding(i) : input(i);
        reply.push_back(static_cast<std::uint8_t>(value >> 8));
        reply.push_back(static_cast<std::uint8_t>(value & 0xFF));
    }
    return reply;
}

Bytes Panel::write_one(const Bytes& pdu) {
    const int address = word(pdu, 1);
    const int value = word(pdu, 3);
    if (address >= kEnd) return refusal(pdu, 2);
    if (pdu[0] == 6) {
        registers_[address] = static_cast<std::uint16_t>(value);
    } else if (value == 0 || value == 0xFF00) {
        coils_[address] = value != 0;
    } else {
        return refusal(pdu, 3);
    }
    ++served_.executed;
    return pdu;
}

Bytes Panel::write_many(const Bytes& pdu) {
    const int address = word(pdu, 1);
    const int count = word(pdu, 3);
    const int size = pdu[0] == 16 ? 2 * count : (count + 7) / 8;
    if (count < 1 || size > 246 || pdu[5] != size) return refusal(pdu, 3);
    if (address + count > kEnd) return refusal(pdu, 2);
    for (int i = 0; i < count; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (pdu[0] == 16) {
            registers_[address + i] = static_cast<std::uint16_t>(word(pdu, 6 + 2 * at));
        } else {
            coils_[address + i] = (pdu[6 + at / 8] >> at % 8 & 1) != 0;
        }
    }
    ++served_.executed;
    return {pdu.begin(), pdu.begin() + 5};
}

}  // namespace zoo
