#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panelgate/points/read_plan.hpp"

namespace panelgate::points {

/// Keeps the contract of Want.
bool is_plannable(const Want& want);

/// How far a read of one table may go, from what is readable, what is wanted and what was refused.
class TableMap {
  public:
    TableMap(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table);

    /// The furthest end (one past the last item) that a read from `first` may have. `first` itself
    /// must be wanted or readable. Less than a want's end when the want contains a refused span.
    std::uint32_t reach(std::uint32_t first) const;

  private:
    struct Piece {
        std::uint32_t first = 0;
        std::uint32_t end = 0;
    };
    std::uint32_t max_items_;
    std::vector<Piece> open_;     ///< disjoint, ascending, never adjacent
    std::vector<Piece> refused_;  ///< ascending; `end` is the least of it and all that follow
};

}  // namespace panelgate::points
