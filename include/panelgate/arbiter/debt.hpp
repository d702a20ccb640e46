#pragma once

#include <cstddef>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// The requests to one station whose replies may still come (P1), oldest first. As a rule they are
/// one and the same; on a way that may stall there may be others among them, which were to prove
/// it. Panels serve in turn: a reply that fits several is that of the oldest. Pure.
class Debt {
  public:
    static constexpr std::size_t kMost = 16;  ///< the oldest is forgotten beyond that

    struct Owed {
        TimePoint sent{};
        Bytes pdu;
    };

    bool empty() const { return owed_.empty(); }
    std::size_t size() const { return owed_.size(); }
    void clear() { owed_.clear(); }
    void add(TimePoint sent, const Bytes& pdu);
    /// The oldest one is owed no more. Not of an empty one.
    void pop() { owed_.pop_front(); }
    /// The one that left first, and last. Not of an empty one.
    TimePoint first_sent() const { return owed_.front().sent; }
    TimePoint last_sent() const { return owed_.back().sent; }
    /// It owes something, and nothing but replies to this very request.
    bool is_only(const Bytes& pdu) const;
    /// This reply may be one of them.
    bool fits(ByteView reply) const { return oldest(reply) != nullptr; }
    /// A normal reply to one of them could be taken for that to this request: the same function,
    /// and the same length or echoed fields. `again`: this request is repeated, so that a reply to
    /// its own earlier attempts is an answer to it.
    bool is_ambiguous(const modbus::Request& request, bool again) const;
    /// The request of what this reply answers was served, and a station serves in turn: those of
    /// the same connection (that left at `connected` or later) and before `sent` were served, too.
    void close_before(TimePoint sent, TimePoint connected);
    /// This reply may be one of them, but not by being one to the very same request.
    bool fits_other(ByteView reply, const Bytes& pdu) const;
    /// A request of another function is among them.
    bool has_other_function(std::uint8_t function) const;
    /// The oldest that this reply may answer, or nullptr.
    const Owed* oldest(ByteView reply) const;
    /// ... that left later than `open`: the last one where none did; nullptr where none fits.
    const Owed* oldest(ByteView reply, TimePoint open) const;
    /// This reply has come: the oldest that it may answer is owed no more. What that was; nothing
    /// where none fits.
    Bytes take(ByteView reply);

  private:
    PoolDeque<Owed> owed_;
};

}  // namespace panelgate::arbiter
