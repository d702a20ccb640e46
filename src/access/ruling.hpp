#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/access/settings.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::access {

/// What the rules that match somebody at a station decide. An act by a function is looked up in an
/// index by item, which is made when it is asked for first: many rules cost as much as one.
class Ruling {
  public:
    /// Of several items the first rule that denies some, else the last that was needed.
    struct Decision {
        bool allowed = true;
        const Rule* rule = nullptr;  ///< null: the default
    };

    Ruling(std::vector<RuleAtStation> rules, bool allow_by_default);

    /// The first rule that matches an item decides the item; a denied item denies the whole act.
    Decision decide(Act act, std::uint8_t function, const modbus::Span& items) const;
    /// With a function that names no items.
    Decision decide(Act act, std::uint8_t function) const;
    /// True if some item of the table is allowed.
    bool allows_some(Act act, std::uint8_t function, modbus::Table table) const;

  private:
    /// From this item up to the next piece's the same rule decides; rules_.size(): the default.
    struct Piece {
        std::uint32_t first = 0;
        std::size_t rule = 0;
    };
    using Pieces = std::vector<Piece>;

    const Pieces& pieces_of(Act act, std::uint8_t function,
                            std::optional<modbus::Table> table) const;
    Pieces make_pieces(Act act, std::uint8_t function, modbus::Table table) const;
    bool allows(std::size_t rule) const;
    Decision decision_of(std::span<const Piece> pieces) const;

    std::vector<RuleAtStation> rules_;
    bool allow_by_default_;
    mutable std::map<std::uint32_t, Pieces> index_;  ///< by act, function and table
};

}  // namespace panelgate::access
