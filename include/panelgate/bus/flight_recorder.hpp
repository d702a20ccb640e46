#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <ranges>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"

namespace panelgate::bus {

/// Keeps the last of what happens on a line, in memory that is set aside at once. Entry has a
/// `sequence`, which only grows.
template <class Entry>
class Recorder {
  public:
    explicit Recorder(std::size_t limit) : limit_(limit) { entries_.reserve(limit); }

    /// Forgets the oldest when full.
    void add(Entry entry) {
        if (limit_ == 0) return;
        if (size_ == limit_) drop_oldest();
        const std::size_t place = (oldest_ + size_++) % limit_;
        if (place == entries_.size()) {
            entries_.push_back(std::move(entry));
        } else {
            entries_[place] = std::move(entry);
        }
    }
    void drop_oldest() {
        if (size_ == 0) return;
        oldest_ = (oldest_ + 1) % limit_;
        --size_;
    }
    void clear() {
        entries_.clear();
        oldest_ = size_ = 0;
    }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    /// The oldest is 0. `place` < size().
    const Entry& at(std::size_t place) const { return entries_[(oldest_ + place) % limit_]; }
    Entry& at(std::size_t place) { return entries_[(oldest_ + place) % limit_]; }
    /// Of the first one behind this number; size() when there is none.
    std::size_t place_behind(std::uint64_t sequence) const {
        const auto places = std::views::iota(std::size_t{0}, size_);
        const auto first = std::ranges::upper_bound(
            places, sequence, {}, [this](std::size_t place) { return at(place).sequence; });
        return static_cast<std::size_t>(first - places.begin());
    }

    /// The last ones, oldest first.
    std::vector<Entry> last(std::size_t count) const {
        return some(size_ - std::min(count, size_), count);
    }
    /// The first ones behind this number, oldest first.
    std::vector<Entry> since(std::uint64_t sequence, std::size_t most) const {
        return some(place_behind(sequence), most);
    }

  private:
    std::vector<Entry> some(std::size_t from, std::size_t most) const {
        std::vector<Entry> chosen;
        const std::size_t count = std::min(most, size_ - from);
        chosen.reserve(count);
        for (std::size_t i = 0; i < count; ++i) chosen.push_back(at(from + i));
        return chosen;
    }

    std::size_t limit_;
    std::vector<Entry> entries_;  ///< a ring when it is full
    std::size_t oldest_ = 0;
    std::size_t size_ = 0;
};

/// Bytes of many entries in a ring of a fixed size: the newest overwrite the oldest.
class ByteRing {
  public:
    /// `size` > 0, bytes.
    explicit ByteRing(std::size_t size);

    /// Where they stand: a number that only grows. Of more than the ring holds, the first.
    std::uint64_t add(ByteView bytes);
    /// Nothing of what stands there has been overwritten.
    bool has(std::uint64_t place) const { return place + size_ >= end_; }
    /// `length` bytes that add() has put there. has(place).
    Bytes at(std::uint64_t place, std::size_t length) const;
    std::size_t size() const { return size_; }
    /// Bytes that were added since those at `place`.
    std::size_t used_since(std::uint64_t place) const {
        return static_cast<std::size_t>(end_ - place);
    }

  private:
    std::size_t size_;
    std::unique_ptr<std::uint8_t[]> bytes_;
    std::uint64_t end_ = 0;  ///< how many were ever added
};

}  // namespace panelgate::bus
