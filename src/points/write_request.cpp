#include <utility>

#include "panelgate/modbus/request.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::points {
namespace {

WriteRefusal refusal(std::string message) { return {std::move(message)}; }

bool has(const profile::PanelProfile& profile, std::uint8_t function) {
    return profile.functions.empty() || profile.find_function(function) != nullptr;
}

Encoded<Bytes> write_coil(const profile::PanelProfile& profile, std::uint16_t address, bool on) {
    if (has(profile, modbus::kWriteSingleCoil)) return modbus::encode_write_coil(address, on);
    if (has(profile, modbus::kWriteMultipleCoils)) return modbus::encode_write_coils(address, {on});
    return refusal(profile.name + " has no function that writes coils");
}

/// The panel's own view of this word's bits, when it can be written (Autonics UB over UW).
const profile::Area* bit_view(const profile::PanelProfile& profile, const Point& point) {
    const profile::Area* words = profile.find_area(point.table, point.address);
    if (words == nullptr) return nullptr;
    const std::uint32_t bit = point.address * 16u + *point.bit;
    for (const profile::Area& area : profile.areas) {
        if (area.view_of == words->name && area.table == modbus::Table::coils && area.writable &&
            area.writable->contains(bit)) {
            return &area;
        }
    }
    return nullptr;
}

Encoded<Bytes> write_bit(const profile::PanelProfile& profile, const Point& point, bool on) {
    if (bit_view(profile, point) != nullptr) {
        const auto coil = static_cast<std::uint16_t>(point.address * 16u + *point.bit);
        return write_coil(profile, coil, on);
    }
    if (has(profile, modbus::kMaskWriteRegister)) {
        const unsigned mask = 1u << *point.bit;
        return Writer()
            .u8(modbus::kMaskWriteRegister)
            .u16(point.address)
            .u16(~mask & 0xFFFFu)
            .u16(on ? mask : 0)
            .take();
    }
    return refusal(profile.name + " can write no single bit of " + point.at +
                   ": it has neither function 22 nor a bit view of it, and reading, changing and "
                   "writing the word would undo what changes in between");
}

}  // namespace

Encoded<Bytes> write_request(const profile::PanelProfile& profile, const Point& point,
                             const Value& value) {
    if (!point.writable) return refusal(point.name + " is not writable");
    const auto items = encode(point, value);
    if (!items) return items.error();
    if (point.table == modbus::Table::coils)
        return write_coil(profile, point.address, items->front() != 0);
    if (point.table != modbus::Table::holding_registers)
        return refusal(point.at + " is in a table that cannot be written");
    if (point.bit) return write_bit(profile, point, items->front() != 0);
    if (items->size() == 1 && has(profile, modbus::kWriteSingleRegister))
        return modbus::encode_write_register(point.address, items->front());
    if (has(profile, modbus::kWriteMultipleRegisters))
        return modbus::encode_write_registers(point.address, *items);
    return refusal(profile.name + " has no function that writes " + std::to_string(items->size()) +
                   " registers at once");
}

std::vector<Interpretation> interpretations(std::span<const std::uint16_t> registers) {
    std::vector<Interpretation> all;
    for (const Type type : kTypes) {
        if (type == Type::boolean) continue;
        for (const WordOrder order : kOrders) {
            Point point;
            point.type = type;
            point.word_order = order;
            if (type == Type::string) point.length = static_cast<unsigned>(registers.size() * 2);
            const unsigned size = point.count();
            const bool words_matter = size > 1 && type != Type::string;
            const bool turned = order == WordOrder::cdab || order == WordOrder::dcba;
            if (size == 0 || size > registers.size() || (turned && !words_matter)) continue;
            Interpretation made{type, order, {}};
            for (std::size_t i = 0; i + size <= registers.size(); i += size) {
                const auto value = decode(point, registers.subspan(i, size));
                made.values.push_back(value ? to_string(*value) : "");
            }
            all.push_back(std::move(made));
        }
    }
    return all;
}

}  // namespace panelgate::points
