#include "memory.hpp"

#include <array>
#include <string_view>

#include "panelgate/modbus/function.hpp"

namespace panelgate::sim {

namespace {}  // namespace

Memory::Memory(const profile::PanelProfile& profile) : profile_(&profile) {
    for (const profile::Area& area : profile.areas) {
        if (area.view_of.empty())
            words_[area.name].resize(area.readable.last - area.readable.first + 1);
    }
}

std::uint16_t Memory::get(const profile::Area& area, std::uint32_t address) const {
    if (area.view_of.empty()) return words_.at(area.name)[address - area.readable.first];
    const profile::Area& words = *profile_->find_area(std::string_view(area.view_of));
    const unsigned word = get(words, address / profile::kBitsPerWord);
    return static_cast<std::uint16_t>(word >> (address % profile::kBitsPerWord) & 1u);
}

void Memory::set(const profile::Area& area, std::uint32_t address, std::uint16_t value) {
    if (area.view_of.empty()) {
        const bool bit = modbus::is_bit_table(area.table);
        words_.at(area.name)[address - area.readable.first] =
            bit && value != 0 ? std::uint16_t{1} : value;
        return;
    }
    const profile::Area& words = *profile_->find_area(std::string_view(area.view_of));
    const unsigned mask = 1u << (address % profile::kBitsPerWord);
    const unsigned old = get(words, address / profile::kBitsPerWord);
    set(words, address / profile::kBitsPerWord,
        static_cast<std::uint16_t>(value != 0 ? old | mask : old & ~mask));
}

namespace {

using modbus::ExceptionCode;

constexpr std::uint8_t kRunning = 0xFF;             // AP 6.13: run indicator
constexpr std::uint8_t kBasicAndIndividual = 0x81;  // AP 6.21: conformity level
constexpr std::uint8_t kIndividual = 4;             // AP 6.21: read device id code
constexpr std::size_t kObjects = 3;                 // vendor, product code, revision

ByteView bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// 2B/0E: MEI type, code and object id follow the function.
Bytes identification(std::string_view profile_name, ByteView pdu) {
    const std::array<std::string_view, kObjects> objects{"panelgate", profile_name, "simulated"};
    const std::uint8_t code = pdu[2];
    std::size_t first = pdu[3];
    if (code < 1 || code > kIndividual)
        return modbus::encode_exception(pdu[0], ExceptionCode::illegal_data_value);
    if (code == kIndividual && first >= kObjects)
        return modbus::encode_exception(pdu[0], ExceptionCode::illegal_data_address);
    if (first >= kObjects) first = 0;  // AP 6.21: an unknown object restarts at the first
    const std::size_t end = code == kIndividual ? first + 1 : kObjects;
    Writer out;
    out.raw(pdu.first(3)).u8(kBasicAndIndividual).u8(0).u8(0);
    out.u8(static_cast<unsigned>(end - first));
    for (std::size_t i = first; i < end; ++i) {
        out.u8(static_cast<unsigned>(i)).u8(static_cast<unsigned>(objects[i].size()));
        out.raw(bytes_of(objects[i]));
    }
    return out.take();
}

}  // namespace

Bytes identity_reply(std::string_view profile_name, std::uint8_t station, std::uint16_t events,
                     ByteView pdu) {
    Writer out;
    out.u8(pdu[0]);
    switch (pdu[0]) {
        case modbus::kReadExceptionStatus:
            return out.u8(0).take();
        case modbus::kDiagnostics:
            if (pdu[1] == 0 && pdu[2] == 0) return {pdu.begin(), pdu.end()};
            break;
        case modbus::kGetCommEventCounter:
            return out.u16(0).u16(events).take();
        case modbus::kReportServerId:
            out.u8(static_cast<unsigned>(2 + profile_name.size())).u8(station).u8(kRunning);
            return out.raw(bytes_of(profile_name)).take();
        case modbus::kEncapsulatedInterface:
            if (pdu[1] == modbus::kMeiDeviceIdentification)
                return identification(profile_name, pdu);
            break;
        default:
            break;
    }
    return modbus::encode_exception(pdu[0], ExceptionCode::illegal_function);
}

}  // namespace panelgate::sim
