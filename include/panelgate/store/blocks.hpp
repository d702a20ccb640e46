#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::store {

/// What the values of a point were in some time. Without a value `count` is 0.
struct Summary {
    double min = 0;
    double max = 0;
    double mean = 0;
    std::uint64_t count = 0;  ///< slots with a value

    void add(double value) { add(Summary{value, value, value, 1}); }
    void add(const Summary& other);
    friend bool operator==(const Summary&, const Summary&) = default;
};

/// Five minutes of a point: a summary for each ten seconds. Pure.
class Block {
  public:
    static constexpr std::chrono::seconds kSlot{10};
    static constexpr std::size_t kSlots = 30;
    static constexpr std::chrono::seconds kSpan = kSlots * kSlot;

    /// Number of the block that a time belongs to, from 1970 on.
    static std::int64_t number_of(WallTime time);
    static WallTime begin_of(std::int64_t number);

    void add(WallTime time, double value);
    /// Adds what another block of the same five minutes holds.
    void add(const Block& other);
    const std::array<Summary, kSlots>& slots() const { return slots_; }

    /// As the database keeps a block: minimum, maximum and mean of each slot, as float32 where no
    /// value loses by that, else as float64. A slot keeps no count of its values.
    std::string bytes() const;
    /// Nothing if the bytes are no block.
    static std::optional<Block> parse(std::string_view bytes);

  private:
    std::array<Summary, kSlots> slots_{};
};

}  // namespace panelgate::store
