#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace panelgate::explorer {

/// Which states were seen, and how far the world was explored from there with how many faults
/// used up. Sixteen bytes a state.
class Visited {
  public:
    Visited() : entries_(std::size_t{1} << 16) {}

    enum class Was : std::uint8_t { unknown, known_less, known };
    /// From this state `left` moves will be tried, `faults` (0..3) were used so far. Known: that is
    /// done already, with no more faults used up and no fewer moves.
    Was visit(std::uint64_t key, int faults, int left) {
        if (size_ * 3 > entries_.size() * 2) grow();
        Entry& entry = find(key);
        const bool is_new = entry.key == 0;
        if (is_new) {
            entry.key = key | 1;
            ++size_;
        }
        const auto tries = static_cast<std::uint8_t>(left + 1);
        for (int f = 0; f <= faults; ++f) {
            if (entry.tries[static_cast<std::size_t>(f)] >= tries) return Was::known;
        }
        entry.tries[static_cast<std::size_t>(faults)] = tries;
        return is_new ? Was::unknown : Was::known_less;
    }
    std::size_t size() const { return size_; }

  private:
    struct Entry {
        std::uint64_t key = 0;  ///< 0: free
        std::array<std::uint8_t, 4> tries{};
    };
    Entry& find(std::uint64_t key) {
        const std::size_t mask = entries_.size() - 1;
        std::size_t at = (key >> 1) & mask;
        while (entries_[at].key != 0 && entries_[at].key != (key | 1)) at = (at + 1) & mask;
        return entries_[at];
    }
    void grow() {
        std::vector<Entry> old(entries_.size() * 2);
        old.swap(entries_);
        for (const Entry& entry : old) {
            if (entry.key != 0) find(entry.key) = entry;
        }
    }

    std::vector<Entry> entries_;
    std::size_t size_ = 0;
};

}  // namespace panelgate::explorer
