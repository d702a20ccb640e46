#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::bus {

/// How much of what happens on a line is remembered. All of it is set aside at once, touched when
/// it is first used, and never grows: with these figures 667 KiB a line, and the names of
/// clients that have gone, as long as something is known of them.
struct TraceSettings {
    std::size_t transactions = 1000;
    std::size_t frames = 2000;
    std::size_t decisions = 500;
    std::size_t bytes = 256 * 1024;  ///< of all frames; the oldest give way
    std::size_t text = 64 * 1024;    ///< of all decisions
};
/// What is kept of what goes wrong: with these figures some 36 KiB each, taken when one happens for
/// the first time and then used again.
struct IncidentSettings {
    std::size_t incidents = 16;
    std::size_t before = 16;  ///< transactions in front of the first error
    std::size_t after = 16;   ///< behind the last one: nearer errors are of the same incident
    Duration near = 10s;      ///< … and not later than this
    TraceSettings each{48, 128, 32, 12 * 1024, 4 * 1024};
};

/// A frame on the wire, for traces.
struct TraceFrame {
    std::uint64_t sequence = 0;  ///< counts a line's frames, decisions and ends, from 1
    TimePoint at;                ///< first bit out; last byte in
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    std::string why;                ///< of a sent frame: why this one at this time
    WallTime time{};                ///< `at`, by the clock on the wall
    std::uint64_t transaction = 0;  ///< that it is of, or came behind; 0: there was none
};

/// Why something was not done, or not at once; one line.
struct TraceDecision {
    std::uint64_t sequence = 0;  ///< one count with the frames
    TimePoint at;
    std::string text;
    WallTime time{};  ///< `at`, by the clock on the wall
};

/// What one request on the wire was, without its frames.
struct TransactionFacts : TransactionInstants {
    std::uint64_t id = 0;                 ///< counts a line's transactions, from 1
    std::uint64_t first = 0;              ///< sequence of its request
    std::uint64_t sequence = 0;           ///< of its end: one count with frames and decisions
    WallTime time{};                      ///< of first_bit_out
    std::optional<TimePoint> answered{};  ///< whoever had asked; nothing: it was not, by this one
    TransactionEnd end = TransactionEnd::ok;
    std::uint8_t station = 0;  ///< 0: a broadcast
};

/// One that is over, and what came of it.
struct TraceTransaction : TransactionFacts {
    FrameKind kind = FrameKind::request;
    std::string reason;  ///< "read", "write", "poll", "retry", "probe"…: what it was sent for
    std::string client;  ///< who wanted it; "": nobody, or one without a name
    Bytes request;
    Bytes reply;  ///< empty: none
    std::vector<TraceFrame> discarded;
};

/// A part of a line's trace, oldest first.
struct TracePart {
    std::vector<TraceFrame> frames;
    std::vector<TraceDecision> decisions;
    std::vector<TraceTransaction> transactions;
};

/// Something went wrong, and what happened around it is kept.
struct IncidentHead {
    std::uint64_t id = 0;                 ///< counts a line's incidents, from 1
    WallTime time{};                      ///< of its first error
    std::optional<std::uint8_t> station;  ///< of that; nothing: the whole line
    std::string cause;                    ///< "timeout", "damaged", "wrong", "late", "line_down"
    std::uint64_t errors = 0;
    bool complete = false;  ///< false: what follows is still being added
    bool read = false;      ///< somebody has fetched it: it gives way before others do
};
struct Incident {
    IncidentHead head;
    TracePart part;
};

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
