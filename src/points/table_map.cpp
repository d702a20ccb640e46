#include "table_map.hpp"

#include <algorithm>

namespace panelgate::points {

bool is_plannable(const Want& want) {
    const modbus::Span& span = want.span;
    return span.count > 0 && span.first < modbus::kTableItems &&
           span.count <= modbus::kTableItems - span.first && want.every > Duration::zero();
}

TableMap::TableMap(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table)
    : max_items_(limits.of(table).max_items) {
    const auto by_first = [](const Piece& a, const Piece& b) { return a.first < b.first; };
    std::vector<Piece> all;
    for (const profile::AddressRange& range : limits.of(table).readable)
        all.push_back({range.first, range.last + 1});
    for (const Want& want : wants)
        if (want.span.table == table && is_plannable(want))
            all.push_back({want.span.first, want.span.end()});
    std::sort(all.begin(), all.end(), by_first);
    for (const Piece& piece : all) {
        if (open_.empty() || piece.first > open_.back().end)
            open_.push_back(piece);
        else
            open_.back().end = std::max(open_.back().end, piece.end);
    }
    for (const modbus::Span& span : limits.refused)
        if (span.table == table && span.count > 0) refused_.push_back({span.first, span.end()});
    std::sort(refused_.begin(), refused_.end(), by_first);
    for (std::size_t i = refused_.size(); i-- > 1;)
        refused_[i - 1].end = std::min(refused_[i - 1].end, refused_[i].end);
}

std::uint32_t TableMap::reach(std::uint32_t first) const {
    std::uint32_t end = first + max_items_;
    const auto after = std::upper_bound(
        open_.begin(), open_.end(), first,
        [](std::uint32_t address, const Piece& piece) { return address < piece.first; });
    if (after != open_.begin()) end = std::min(end, std::prev(after)->end);
    const auto refused = std::lower_bound(
        refused_.begin(), refused_.end(), first,
        [](const Piece& piece, std::uint32_t address) { return piece.first < address; });
    if (refused != refused_.end()) end = std::min(end, refused->end - 1);
    return end;
}

}  // namespace panelgate::points
