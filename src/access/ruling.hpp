#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
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

    /// Each item is decided by the first rule that matches it; one that is denied denies them all.
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
    /// What decides an act by a function. Most requests are about items of the piece before: what
    /// is decided for them stands here, so that the pieces stay out of the caches.
    struct Index {
        std::uint32_t key = 0;    ///< act, function, table
        std::uint32_t first = 1;  ///< of the piece that was asked for last; as yet none
        std::uint32_t end = 0;
        Decision decision{};
        Pieces pieces{};
    };

    Index& index_of(Act act, std::uint8_t function, std::optional<modbus::Table> table) const;
    Pieces make_pieces(Act act, std::uint8_t function, modbus::Table table) const;
    std::size_t first_without_items(Act act, std::uint8_t function) const;
    bool allows(std::size_t rule) const;
    Decision decision_of(std::span<const Piece> pieces) const;

    std::vector<RuleAtStation> rules_;
    bool allow_by_default_;
    mutable std::vector<Index> index_;
};

}  // namespace panelgate::access
