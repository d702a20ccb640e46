#include "verification.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "refusal.hpp"

namespace panelgate::web {
namespace {

/// Behind function and address of 0F and 10: quantity and byte count.
constexpr std::size_t kMultipleHead = 6;

/// The panel's own view of this memory comes first, then the others.
std::vector<modbus::Table> tables_of(const profile::PanelProfile& panel, const modbus::Span& span) {
    std::vector<modbus::Table> tables{span.table};
    const profile::Area* area = panel.find_area(span.table, span.first);
    if (area == nullptr) return tables;
    tables.push_back(area->table);
    tables.insert(tables.end(), area->also.begin(), area->also.end());
    std::erase_if(tables, [&](modbus::Table table) {
        return modbus::is_bit_table(table) != modbus::is_bit_table(span.table);
    });
    return tables;
}

}  // namespace

std::optional<Verification> Verification::of(const modbus::Request& write) {
    const auto span = write.access().write;
    if (!span) return std::nullopt;
    const ByteView pdu = write.pdu();
    Verification made;
    made.span_ = *span;
    Reader in(pdu.subspan(3));
    switch (write.function()) {
        case modbus::kWriteSingleCoil:
            made.cells_.push_back({static_cast<std::uint16_t>(in.u16() != 0)});
            return made;
        case modbus::kWriteSingleRegister:
            made.cells_.push_back({in.u16()});
            return made;
        case modbus::kMaskWriteRegister: {
            const std::uint16_t kept = in.u16();
            const std::uint16_t set = in.u16();
            const auto mask = static_cast<std::uint16_t>(~kept);
            made.cells_.push_back({static_cast<std::uint16_t>(set & mask), mask});
            return made;
        }
        case modbus::kWriteMultipleCoils:
            for (unsigned i = 0; i < span->count; ++i) {
                const unsigned bit = pdu[kMultipleHead + i / 8] >> (i % 8) & 1u;
                made.cells_.push_back({static_cast<std::uint16_t>(bit)});
            }
            return made;
        case modbus::kWriteMultipleRegisters: {
            Reader data(pdu.subspan(kMultipleHead));
            for (unsigned i = 0; i < span->count; ++i) made.cells_.push_back({data.u16()});
            return made;
        }
        default:
            return std::nullopt;
    }
}

Parsed<modbus::Span> Verification::span_to_read(const profile::PanelProfile& panel) const {
    for (const modbus::Table table : tables_of(panel, span_)) {
        const std::uint8_t function = read_function(table);
        if (panel.has_function(function) && span_.count <= panel.max_count(function))
            return modbus::Span{table, span_.first, span_.count};
    }
    return ruled_out(bus::Rule::function,
                     "verify is not possible: the panel has no function that "
                     "reads its " +
                         std::string(label(span_.table)));
}

bool Verification::holds(std::span<const std::uint16_t> items) const {
    return std::ranges::equal(items, cells_, [](std::uint16_t item, const Cell& cell) {
        return (item & cell.mask) == cell.value;
    });
}

}  // namespace panelgate::web
