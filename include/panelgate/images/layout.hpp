#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "panelgate/images/settings.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::images {

/// Where a point stands in an image. Registers are in both tables of registers, bits in both of
/// bits; here holding registers and coils.
struct Place {
    const Entry* entry = nullptr;
    const points::Point* point = nullptr;
    modbus::Span items{};
    std::optional<std::uint32_t> quality{};  ///< the item that tells it, behind `items`

    /// Returns the first item that is not the place's.
    std::uint32_t end() const { return quality ? *quality + 1 : items.end(); }
};

/// What a place shows now.
struct Shown {
    std::span<const std::uint16_t> items;  ///< as the panel has them; empty: never read
    points::Quality quality = points::Quality::bad;
};

/// Finds a point of a station; null: there is none.
using FindPoint =
    std::function<const points::Point*(std::string_view station, std::string_view point)>;

/// The map of an image: registers and bits each from 0, in the order of the entries. The settings
/// and the points outlive it. Pure.
class Layout {
  public:
    Layout() = default;
    /// Entries that `find` does not find are left out.
    Layout(const Settings& settings, const FindPoint& find);

    const std::vector<Place>& places() const { return places_; }
    /// Returns the number of items in a table.
    std::uint32_t size(modbus::Table table) const {
        return modbus::is_bit_table(table) ? bits_ : registers_;
    }
    /// Returns the indexes of the places to which the items belong.
    std::vector<std::size_t> touched(const modbus::Span& items) const;
    /// Returns the items of a read; nothing where `stale` allows none. `shown`: of each touched
    /// place, in their order. Free items are 0.
    std::optional<std::vector<std::uint16_t>> read(const modbus::Span& items, Stale stale,
                                                   std::span<const std::size_t> touched,
                                                   std::span<const Shown> shown) const;
    /// True if a write of these items writes whole points and nothing else.
    bool is_whole(const modbus::Span& items, std::span<const std::size_t> touched) const;

  private:
    std::vector<Place> places_;
    std::vector<std::size_t> of_registers_;  ///< places, in the order of their items
    std::vector<std::size_t> of_bits_;
    std::uint32_t registers_ = 0;
    std::uint32_t bits_ = 0;
};

}  // namespace panelgate::images
