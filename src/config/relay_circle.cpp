#include "relay_circle.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace panelgate::config {
namespace {

/// One bit of one panel.
struct Item {
    const Station* station = nullptr;
    modbus::Table table = modbus::Table::holding_registers;
    std::uint32_t bit = 0;

    friend bool operator==(const Item&, const Item&) = default;
};

/// Each item is written by one copy at most, so the way back from it is one.
class WayBack {
  public:
    explicit WayBack(const std::vector<Copy>& copies) : copies_(copies) {
        for (std::size_t i = 0; i < copies.size(); ++i) {
            const Memory& to = copies[i].to;
            by_target_.emplace(std::tuple(to.station, to.bits.table, to.bits.first), i);
        }
    }

    /// The copy that writes it.
    std::optional<std::size_t> writer(const Item& item) const {
        auto next = by_target_.upper_bound(std::tuple(item.station, item.table, item.bit));
        if (next == by_target_.begin()) return std::nullopt;
        const std::size_t copy = std::prev(next)->second;
        const Memory& to = copies_[copy].to;
        if (to.station != item.station || !to.bits.contains({item.table, item.bit, 1}))
            return std::nullopt;
        return copy;
    }
    Item source(const Item& item, std::size_t copy) const {
        const auto& [from, to] = copies_[copy];
        return {from.station, from.bits.table, from.bits.first + item.bit - to.bits.first};
    }

  private:
    const std::vector<Copy>& copies_;
    std::map<std::tuple<const Station*, modbus::Table, std::uint32_t>, std::size_t> by_target_;
};

/// Bits that go the same way: words, where all are of words.
std::uint32_t stride(const std::vector<Copy>& copies) {
    constexpr std::uint32_t kWord = 16;
    const auto whole = [](const Memory& memory) {
        return memory.bits.first % kWord == 0 && memory.bits.count % kWord == 0;
    };
    const bool words = std::ranges::all_of(
        copies, [&](const Copy& copy) { return whole(copy.from) && whole(copy.to); });
    return words ? kWord : 1;
}

/// As the values go, beginning with `last`, each once.
std::vector<std::size_t> in_order(std::vector<std::size_t> back, std::size_t last) {
    std::ranges::reverse(back);
    std::ranges::rotate(back, std::ranges::find(back, last));
    std::vector<std::size_t> once;
    for (const std::size_t copy : back) {
        if (std::ranges::find(once, copy) == once.end()) once.push_back(copy);
    }
    return once;
}

}  // namespace

std::vector<std::size_t> find_circle(const std::vector<Copy>& copies) {
    const WayBack way(copies);
    const std::size_t last = copies.size() - 1;
    const Memory& from = copies[last].from;
    const std::uint32_t step = stride(copies);
    std::vector<bool> passed(from.bits.count);  // every circle goes through `last`
    for (std::uint32_t i = 0; i < from.bits.count; i += step) {
        const Item begin{from.station, from.bits.table, from.bits.first + i};
        std::vector<std::size_t> back;
        Item item = begin;
        while (const auto copy = way.writer(item)) {
            back.push_back(*copy);
            item = way.source(item, *copy);
            if (item == begin) return in_order(std::move(back), last);
            if (*copy != last) continue;
            const std::uint32_t offset = item.bit - from.bits.first;
            if (passed[offset]) break;
            passed[offset] = true;
        }
    }
    return {};
}

}  // namespace panelgate::config
