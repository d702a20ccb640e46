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

/// Sizes of a line's trace. The memory is reserved at once, touched when first used, and never
/// grows: 667 KiB a line with these figures, plus the names of departed clients while records refer
/// to them.
struct TraceSettings {
    std::size_t transactions = 1000;
    std::size_t frames = 2000;
    std::size_t decisions = 500;
    std::size_t bytes = 256 * 1024;  ///< of all frames; the oldest are dropped
    std::size_t text = 64 * 1024;    ///< of all decisions

    /// The sizes for one of so many lines: all lines together have no more than kFull full ones.
    static TraceSettings of(std::size_t lines) {
        constexpr std::size_t kFull = 32;
        TraceSettings sizes;
        if (lines > kFull)
            for (std::size_t* const size :
                 {&sizes.transactions, &sizes.frames, &sizes.decisions, &sizes.bytes, &sizes.text})
                *size = *size * kFull / lines;
        return sizes;
    }
};
/// Sizes of the incident records: about 36 KiB each with these figures, allocated at the first
/// incident and then reused.
struct IncidentSettings {
    std::size_t incidents = 16;
    std::size_t before = 16;  ///< transactions before the first error
    std::size_t after =
        16;  ///< transactions after the last error: an error among them is of the same incident
    Duration near = 10s;  ///< … and not later than this
    TraceSettings each{48, 128, 32, 12 * 1024, 4 * 1024};
};

/// A frame on the wire, for traces.
struct TraceFrame {
    std::uint64_t sequence = 0;  ///< numbers a line's frames, decisions and transaction ends from 1
    TimePoint at;                ///< first bit out, or last byte in
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    std::string why;                ///< why a sent frame was sent at this time
    WallTime time{};                ///< `at` as wall-clock time
    std::uint64_t transaction = 0;  ///< that it belongs to, or followed; 0: none
};

/// Why something was not done, or not at once; one line of text.
struct TraceDecision {
    std::uint64_t sequence = 0;  ///< same numbering as the frames
    TimePoint at;
    std::string text;
    WallTime time{};  ///< `at` as wall-clock time
};

/// A request on the wire, without its frames.
struct TransactionFacts : TransactionInstants {
    std::uint64_t id = 0;        ///< numbers a line's transactions from 1
    std::uint64_t first = 0;     ///< sequence of its request
    std::uint64_t sequence = 0;  ///< of its end; same numbering as frames and decisions
    WallTime time{};             ///< of first_bit_out
    std::optional<TimePoint>
        answered{};  ///< when it first answered a request; nullopt: it answered none
    TransactionEnd end = TransactionEnd::ok;
    std::uint8_t station = 0;  ///< 0: broadcast
};

/// A finished transaction with its frames.
struct TraceTransaction : TransactionFacts {
    FrameKind kind = FrameKind::request;
    std::string reason;  ///< why it was sent: "read", "write", "poll", "retry", "probe"…
    std::string client;  ///< its client's name; "": no client, or one without a name
    Bytes request;
    Bytes reply;  ///< empty: no reply
    std::vector<TraceFrame> discarded;
};

/// Part of a line's trace, oldest first.
struct TracePart {
    std::vector<TraceFrame> frames;
    std::vector<TraceDecision> decisions;
    std::vector<TraceTransaction> transactions;
};

/// Summary of an incident: errors and the records around them.
struct IncidentHead {
    std::uint64_t id = 0;                 ///< numbers a line's incidents from 1
    WallTime time{};                      ///< of its first error
    std::optional<std::uint8_t> station;  ///< of the first error; nullopt: the whole line
    std::string cause;                    ///< "timeout", "damaged", "wrong", "late", "line_down"
    std::uint64_t errors = 0;
    bool complete = false;  ///< false: records are still being added
    bool read = false;      ///< already fetched: overwritten before unread incidents
};
struct Incident {
    IncidentHead head;
    TracePart part;
};

/// Ring buffer of the last entries, in memory reserved at construction. Entry has an increasing
/// `sequence`.
template <class Entry>
class Recorder {
  public:
    explicit Recorder(std::size_t limit) : limit_(limit) { entries_.reserve(limit); }

    /// Drops the oldest entry when full.
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
    /// Index 0 is the oldest entry. `place` < size().
    const Entry& at(std::size_t place) const { return entries_[(oldest_ + place) % limit_]; }
    Entry& at(std::size_t place) { return entries_[(oldest_ + place) % limit_]; }
    /// Returns the index of the first entry after this sequence number; size() if there is none.
    std::size_t index_after(std::uint64_t sequence) const {
        const auto places = std::views::iota(std::size_t{0}, size_);
        const auto first = std::ranges::upper_bound(
            places, sequence, {}, [this](std::size_t place) { return at(place).sequence; });
        return static_cast<std::size_t>(first - places.begin());
    }

    /// Returns the last entries, oldest first.
    std::vector<Entry> last(std::size_t count) const {
        return some(size_ - std::min(count, size_), count);
    }
    /// Returns the first entries after this sequence number, oldest first.
    std::vector<Entry> since(std::uint64_t sequence, std::size_t most) const {
        return some(index_after(sequence), most);
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
    std::vector<Entry> entries_;  ///< a ring once full
    std::size_t oldest_ = 0;
    std::size_t size_ = 0;
};

/// Byte storage for many entries in a fixed-size ring: the newest overwrite the oldest.
class ByteRing {
  public:
    /// `size` > 0, bytes.
    explicit ByteRing(std::size_t size);

    /// Appends bytes and returns their position, which only grows. Truncates to the ring's size.
    std::uint64_t add(ByteView bytes);
    /// True if nothing from this position on has been overwritten.
    bool has(std::uint64_t place) const { return place + size_ >= end_; }
    /// Returns `length` bytes stored by add(). Requires has(place).
    Bytes at(std::uint64_t place, std::size_t length) const;
    std::size_t size() const { return size_; }
    /// Returns the number of bytes added since `place`.
    std::size_t used_since(std::uint64_t place) const {
        return static_cast<std::size_t>(end_ - place);
    }

  private:
    std::size_t size_;
    std::unique_ptr<std::uint8_t[]> bytes_;
    std::uint64_t end_ = 0;  ///< total bytes added
};

}  // namespace panelgate::bus
