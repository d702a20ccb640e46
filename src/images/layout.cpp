#include "panelgate/images/layout.hpp"

#include <algorithm>

namespace panelgate::images {

namespace {

using modbus::Table;

/// The items that the panel has for the point, as the image shows them: a bit of a word is one bit.
void copy_items(const Place& place, const Shown& shown, std::span<std::uint16_t> to) {
    if (place.point->bit)
        to[0] = static_cast<std::uint16_t>(shown.items[0] >> *place.point->bit & 1);
    else
        std::ranges::copy(shown.items, to.begin());
}

}  // namespace

Layout::Layout(const Settings& settings, const FindPoint& find) {
    for (const Entry& entry : settings.entries) {
        registers_ += entry.skip;
        const points::Point* const point =
            entry.station.empty() ? nullptr : find(entry.station, entry.point);
        if (point == nullptr) continue;
        const bool is_bit = point->type == points::Type::boolean;
        std::uint32_t& end = is_bit ? bits_ : registers_;
        Place place{
            &entry,
            point,
            {is_bit ? Table::coils : Table::holding_registers, end, is_bit ? 1 : point->count()}};
        if (settings.quality) place.quality = place.items.end();
        end = place.end();
        (is_bit ? of_bits_ : of_registers_).push_back(places_.size());
        places_.push_back(place);
    }
}

std::vector<std::size_t> Layout::touched(const modbus::Span& items) const {
    const auto& all = modbus::is_bit_table(items.table) ? of_bits_ : of_registers_;
    const auto first = std::ranges::partition_point(
        all, [&](std::size_t at) { return places_[at].end() <= items.first; });
    const auto end = std::partition_point(
        first, all.end(), [&](std::size_t at) { return places_[at].items.first < items.end(); });
    return {first, end};
}

std::optional<std::vector<std::uint16_t>> Layout::read(const modbus::Span& items, Stale stale,
                                                       std::span<const std::size_t> touched,
                                                       std::span<const Shown> shown) const {
    std::vector<std::uint16_t> made(items.count);
    std::vector<std::uint16_t> whole;  // a place may begin before the read, or end behind it
    for (std::size_t i = 0; i < touched.size(); ++i) {
        const Place& place = places_[touched[i]];
        const bool is_good = shown[i].quality == points::Quality::good;
        if (!is_good && stale == Stale::exception) return std::nullopt;
        if (shown[i].items.empty() && !place.quality) return std::nullopt;
        whole.assign(place.end() - place.items.first, 0);
        if (!shown[i].items.empty()) copy_items(place, shown[i], whole);
        if (place.quality) whole.back() = static_cast<std::uint16_t>(shown[i].quality);
        const std::uint32_t first = std::max(items.first, place.items.first);
        const std::uint32_t end = std::min(items.end(), place.end());
        std::copy_n(whole.begin() + (first - place.items.first), end - first,
                    made.begin() + (first - items.first));
    }
    return made;
}

bool Layout::is_whole(const modbus::Span& items, std::span<const std::size_t> touched) const {
    std::uint32_t next = items.first;
    for (const std::size_t at : touched) {
        if (places_[at].items.first != next) return false;
        next = places_[at].items.end();
    }
    return next == items.end();
}

}  // namespace panelgate::images
