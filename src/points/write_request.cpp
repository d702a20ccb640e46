#include <utility>

#include "panelgate/modbus/request.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::points {
namespace {

WriteRefusal refusal(std::string message) { return {.message = std::move(message)}; }

bool writes_coils(const profile::PanelProfile& profile) {
    return profile.has_function(modbus::kWriteSingleCoil) ||
           profile.has_function(modbus::kWriteMultipleCoils);
}

/// The panel has one of the two functions.
Bytes write_coil(const profile::PanelProfile& profile, std::uint16_t address, bool on) {
    if (profile.has_function(modbus::kWriteSingleCoil))
        return modbus::encode_write_coil(address, on);
    return modbus::encode_write_coils(address, {on});
}

/// The panel's own view of this word's bits, when it can be written (Autonics UB over UW).
const profile::Area* bit_view(const profile::PanelProfile& profile, const Point& point) {
    const profile::Area* words = profile.find_area(point.table, point.address);
    if (words == nullptr) return nullptr;
    const std::uint32_t bit = point.address * 16u + *point.bit;
    for (const profile::Area& area : profile.areas) {
        if (area.view_of == words->name && area.table == modbus::Table::coils && area.writable &&
            area.writable->contains(bit) && writes_coils(profile)) {
            return &area;
        }
    }
    return nullptr;
}

/// The panel has one of the two ways.
Bytes write_bit(const profile::PanelProfile& profile, const Point& point, bool on) {
    if (bit_view(profile, point) != nullptr) {
        const auto coil = static_cast<std::uint16_t>(point.address * 16u + *point.bit);
        return write_coil(profile, coil, on);
    }
    const unsigned mask = 1u << *point.bit;
    return Writer()
        .u8(modbus::kMaskWriteRegister)
        .u16(point.address)
        .u16(~mask & 0xFFFFu)
        .u16(on ? mask : 0)
        .take();
}

std::optional<std::string> why_no_bit(const profile::PanelProfile& profile, const Point& point) {
    if (bit_view(profile, point) != nullptr) return std::nullopt;
    if (profile.has_function(modbus::kMaskWriteRegister)) return std::nullopt;
    return profile.name + " can write no single bit of " + point.at +
           ": it has neither function 22 nor a bit view of it, and reading, changing and writing "
           "the word would undo what changes in between";
}

std::optional<std::string> why_no_registers(const profile::PanelProfile& profile, unsigned count) {
    if (count == 1 && profile.has_function(modbus::kWriteSingleRegister)) return std::nullopt;
    const bool several = profile.has_function(modbus::kWriteMultipleRegisters);
    const unsigned most = several ? profile.max_count(modbus::kWriteMultipleRegisters) : 0;
    if (count <= most) return std::nullopt;
    if (several)
        return profile.name + " takes at most " + std::to_string(most) +
               " registers in one write, not " + std::to_string(count);
    return profile.name + " has no function that writes " + std::to_string(count) +
           (count == 1 ? " register" : " registers at once");
}

Bytes pdu_of(const profile::PanelProfile& profile, const Point& point,
             const std::vector<std::uint16_t>& items) {
    if (point.table == modbus::Table::coils)
        return write_coil(profile, point.address, items.front() != 0);
    if (point.bit) return write_bit(profile, point, items.front() != 0);
    if (items.size() == 1 && profile.has_function(modbus::kWriteSingleRegister))
        return modbus::encode_write_register(point.address, items.front());
    return modbus::encode_write_registers(point.address, items);
}

/// What a read of these items will show; of one bit of a word there is only the bit.
Value written_value(const Point& point, const std::vector<std::uint16_t>& items) {
    if (point.type == Type::boolean) return items.front() != 0;
    return *decode(point, items);
}

}  // namespace

std::optional<std::string> why_unwritable(const profile::PanelProfile& profile,
                                          const Point& point) {
    if (point.table == modbus::Table::coils) {
        if (writes_coils(profile)) return std::nullopt;
        return profile.name + " has no function that writes coils";
    }
    if (point.table != modbus::Table::holding_registers)
        return point.at + " is in a table that cannot be written";
    if (point.bit) return why_no_bit(profile, point);
    return why_no_registers(profile, point.count());
}

Encoded<PointWrite> write_request(const profile::PanelProfile& profile, const Point& point,
                                  const Value& value, Rounding rounding) {
    if (!point.writable) return refusal(point.name + " is not writable");
    if (auto why = why_unwritable(profile, point)) return refusal(std::move(*why));
    const auto items = encode(point, value, rounding);
    if (!items) return items.error();
    return PointWrite{pdu_of(profile, point, *items), written_value(point, *items),
                      label_of(point, *items)};
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
