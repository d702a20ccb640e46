#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

/// The requests to one station whose replies may still come (P1), oldest first. Normally they are
/// identical; on a transport that may stall there may also be the requests that were to prove it.
/// Panels serve in order: a reply that fits several belongs to the oldest. Pure.
class OutstandingReplies {
  public:
    static constexpr std::size_t kMost = 16;  ///< the oldest is forgotten beyond that

    struct Entry {
        TimePoint sent{};
        Bytes pdu;
    };

    bool empty() const { return entries_.empty(); }
    std::size_t size() const { return entries_.size(); }
    void clear() { entries_.clear(); }
    void add(TimePoint sent, const Bytes& pdu);
    /// Removes the oldest. Must not be empty.
    void pop() { entries_.pop_front(); }
    /// When the first and the last of them left. Must not be empty.
    TimePoint first_sent() const { return entries_.front().sent; }
    TimePoint last_sent() const { return entries_.back().sent; }
    /// True if not empty and all are this very request.
    bool is_only(const Bytes& pdu) const;
    /// True if this reply may answer one of them.
    bool fits(ByteView reply) const { return oldest(reply) != nullptr; }
    /// True if a normal reply to one of them could be taken for the reply to this request: same
    /// function, and same length or echoed fields. `again`: this is a retry, so replies to its own
    /// earlier attempts answer it.
    bool is_ambiguous(const modbus::Request& request, bool again) const;
    /// A request that left at `sent` was served, and a station serves in order: removes the earlier
    /// ones of the same connection (that left at `connected` or later).
    void close_before(TimePoint sent, TimePoint connected);
    /// True if this reply may answer one of them that is another request.
    bool fits_other(ByteView reply, const Bytes& pdu) const;
    /// True if a request of another function is among them.
    bool has_other_function(std::uint8_t function) const;
    /// Returns the oldest that this reply may answer, or nullptr.
    const Entry* oldest(ByteView reply) const;
    /// ... that left later than `open`; else the last that fits, or nullptr.
    const Entry* oldest(ByteView reply, TimePoint open) const;
    /// Removes the oldest that this reply may answer and returns its PDU; empty if none fits.
    Bytes take(ByteView reply);

  private:
    PoolDeque<Entry> entries_;
};

/// What is known of a transport that may delay frames and deliver them later (RTU over TCP). An
/// accepted connection proves nothing: the kernel of a hung device server accepts it, and requests
/// sent on the previous connection may be served, and answered, after that. Pure.
class TransportEpoch {
  public:
    void on_opened(TimePoint now) { opened_ = now; }
    /// A request that was started then has been answered.
    void on_proved(TimePoint started) { proved_ = std::max(proved_, started); }

    /// Requests sent before this time have been delivered.
    TimePoint proved() const { return proved_; }
    /// Requests sent before this time used an earlier connection.
    TimePoint opened() const { return opened_; }

  private:
    TimePoint opened_{};
    TimePoint proved_{};
};

/// What a station with outstanding replies has done since the line was reopened because of them.
/// Pure.
class ReconnectState {
  public:
    void on_opened() {
        opened_ = true;
        answered_ = false;
    }
    /// A request to it has ended without its own reply.
    void on_outstanding() { opened_ = answered_ = false; }
    /// `quick`: within half of its timeout. A slow one is not asked for another length again: that
    /// takes as long as waiting.
    void on_replied(bool quick) {
        answered_ = opened_;
        unanswered_ = 0;
        if (only_known_reads_ && quick && ++replies_ >= kEnough) only_known_reads_ = false;
    }
    /// `distinct_length`: a read sent only because its reply's length is distinct.
    void on_probe_unanswered(bool distinct_length) {
        only_known_reads_ = distinct_length;
        replies_ = 0;
        unanswered_ = std::min(unanswered_ + 1, kMost);
    }

    /// True if it has answered each request since then, and at least one. These may have been the
    /// outstanding replies in order: then as many are still to come, at once.
    bool answered() const { return answered_; }
    /// True if it may answer only the reads that it has answered before.
    bool only_known_reads() const { return only_known_reads_; }
    /// True if it did not answer those either: perhaps it answers only writes.
    bool reads_unanswered() const { return unanswered_ >= kMost; }

  private:
    static constexpr int kMost = 3;
    static constexpr int kEnough =
        16;  ///< replies after which the other length may just have been lost

    int replies_ = 0;     ///< since it did not answer a read of another length
    int unanswered_ = 0;  ///< in a row
    bool opened_ = false;
    bool answered_ = false;
    bool only_known_reads_ = false;
};

/// The replies that panels which wrongly answer broadcasts may still send: after the turnaround one
/// would pass for the reply to a write that is confirmed by the same bytes (P8). Pure.
class BroadcastReplies {
  public:
    static constexpr std::size_t kBroadcasts = 16;  ///< that are remembered

    void on_sent(TimePoint sent, ByteView request) {
        Sent& oldest = last_[next_++ % kBroadcasts];
        oldest = {sent, modbus::normal_write_reply(request)};
    }
    /// Time from which no reply to a broadcast can be taken for the reply to `request`. `window`:
    /// how long after a broadcast its station may answer it.
    TimePoint over(const modbus::Request& request, Duration window) const {
        TimePoint over{};
        if (request.is_read()) return over;
        for (const Sent& one : last_) {
            if (!one.reply.empty() && modbus::answers(request.pdu(), one.reply))
                over = std::max(over, one.at + window);
        }
        return over;
    }

  private:
    struct Sent {
        TimePoint at{};
        Bytes reply;
    };
    std::array<Sent, kBroadcasts> last_;
    std::size_t next_ = 0;
};

/// Requests heard from other masters: a frame that answers one of them may be its reply. Pure.
class ForeignRequests {
  public:
    static constexpr std::size_t kMost = 8;  ///< the oldest is forgotten beyond that

    /// The bytes begin with another master's request. Broadcasts, which have no reply, are ignored.
    void on_heard(TimePoint now, ByteView bytes);
    bool empty() const { return requests_.empty(); }
    void clear() { requests_.clear(); }
    /// True if this frame answers one heard at `since` or later.
    bool fit(ByteView adu, TimePoint since = TimePoint::min()) const;

  private:
    struct Entry {
        TimePoint at{};
        Bytes adu;
    };
    std::vector<Entry> requests_;
};

}  // namespace panelgate::arbiter
