#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// The requests to one station whose replies may still come (P1), oldest first. Normally they are
/// identical; on a transport that may stall there may also be the requests that were to prove it.
/// Panels serve in order: a reply that fits several belongs to the oldest, and one to a later
/// request closes the earlier ones. What was closed so is remembered: its reply may still come from
/// a panel that does not. Pure.
class OutstandingReplies {
  public:
    static constexpr std::size_t kMost = 16;  ///< the oldest is forgotten beyond that

    struct Entry {
        TimePoint sent{};
        Bytes pdu;
        bool lapsed = false;  ///< closed by time, not by order
    };

    bool empty() const { return entries_.empty(); }
    std::size_t size() const { return entries_.size(); }
    void clear() { entries_.clear(); }
    /// None can be answered any more, as far as is known of its station.
    void lapse();
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
    /// This reply came: closes the oldest request that it may answer, and those before it on its
    /// connection. Closes none if what it may answer left over the present connection, opened at
    /// `connected`, and over an earlier one: their order is unknown. `asked`: a request that it may
    /// answer, too, has left over the present one and is not among these.
    void close(ByteView reply, TimePoint connected, bool asked);
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
    /// True if this reply may answer one that was closed by a later request's answer, or that has
    /// lapsed, and that left later than `open`.
    bool fits_closed(ByteView reply, TimePoint open) const;
    /// ... one that was closed so, and that is not the request `but`.
    bool fits_closed_by_order(ByteView reply, TimePoint open, ByteView but) const;
    /// Removes and returns the first of those that fits_closed(); it must be true.
    Entry take_closed(ByteView reply, TimePoint open);

  private:
    void remember_closed(Entry entry);

    PoolDeque<Entry> entries_;
    PoolDeque<Entry> closed_;  ///< by the order in which stations serve, or by time
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
        if (only_known_reads_ && quick && ++replies_ >= kEnough) only_known_reads_ = false;
    }
    /// `distinct_length`: a read sent only because its reply's length is distinct.
    void on_probe_unanswered(bool distinct_length) {
        only_known_reads_ = distinct_length;
        replies_ = 0;
    }

    /// True if it has answered each request since then, and at least one. These may have been the
    /// outstanding replies in order: then as many are still to come, at once.
    bool answered() const { return answered_; }
    /// True if it may answer only the reads that it has answered before.
    bool only_known_reads() const { return only_known_reads_; }

  private:
    static constexpr int kEnough =
        16;  ///< replies after which the other length may just have been lost

    int replies_ = 0;  ///< since it did not answer a read of another length
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
        oldest = {sent, Bytes(request.begin(), request.end()), modbus::normal_write_reply(request)};
    }
    /// How long after the last one that this frame may answer it has come; empty: it answers none.
    std::optional<Duration> delay_of(TimePoint now, ByteView reply) const {
        std::optional<Duration> delay;
        for (const Sent& one : last_) {
            if (one.request.empty() || now >= one.at + timing::kLatestBroadcastAnswer) continue;
            if (!modbus::answers(one.request, reply)) continue;
            delay = std::min(delay.value_or(timing::kLatestBroadcastAnswer), now - one.at);
        }
        return delay;
    }
    /// Time from which no reply to a broadcast can be taken for the reply to `request`. `window`:
    /// how long after a broadcast its station may answer it; `refuses`: also by an exception, which
    /// any request of the same function may have.
    TimePoint over(const modbus::Request& request, Duration window, bool refuses = false) const {
        TimePoint over{};
        if (request.is_read()) return over;
        for (const Sent& one : last_) {
            if (one.reply.empty()) continue;
            const bool same = refuses && one.request[0] == request.function();
            if (same || modbus::answers(request.pdu(), one.reply))
                over = std::max(over, one.at + window);
        }
        return over;
    }

  private:
    struct Sent {
        TimePoint at{};
        Bytes request;
        Bytes reply;  ///< the normal one, made once: over() is asked for each waiting write
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

/// Answers that a station was seen to give to different requests: each is trusted after three
/// times, and any other as soon as three different ones were seen. Zeros say nothing of other
/// values. Pure.
class EqualAnswers {
  public:
    static constexpr int kEnough = 3;

    void add(ByteView reply) {
        for (Seen& one : seen_) {
            if (one.times > 0 && !std::ranges::equal(one.reply, reply)) continue;
            if (one.times == 0) one.reply.assign(reply.begin(), reply.end());
            one.times = std::min(one.times + 1, kEnough);
            return;
        }
    }
    bool trusts(ByteView reply) const {
        return seen_.back().times > 0 || std::ranges::any_of(seen_, [&](const Seen& one) {
                   return one.times == kEnough && std::ranges::equal(one.reply, reply);
               });
    }

  private:
    struct Seen {
        Bytes reply;
        int times = 0;
    };
    std::array<Seen, kEnough> seen_;
};

/// Detects that a station sends its replies twice, or that two panels share one address, and how
/// long after a reply the second one must be awaited: it could pass for the answer to a request of
/// the same shape (P1). An exact repetition is a duplicate at once; a frame of the same shape must
/// occur twice, because other stations send too. Forgotten some minutes after it stopped. Pure.
class DuplicateGuard {
  public:
    static constexpr std::size_t kReplies = 8;
    static constexpr int kConfirmations = EqualAnswers::kEnough;
    static constexpr int kDenials = 3;  ///< after which they count as duplicates

    void on_reply(TimePoint now, Bytes request, Bytes reply) {
        if (now - learned_at_ > timing::kForgetDuplicates) learned_ = {};
        Slot& slot = slots_[next_++ % kReplies];
        slot = {};
        slot.at = now;
        slot.request = std::move(request);
        slot.reply = std::move(reply);
    }
    /// True if it repeats a recent reply exactly.
    bool is_duplicate(TimePoint now, ByteView reply) const {
        return earlier_reply_at(now, reply) != TimePoint{};
    }
    /// ... as soon as duplicates come from this station.
    bool repeats_itself(TimePoint now, ByteView reply) const {
        const TimePoint earlier = earlier_reply_at(now, reply);
        return earlier != TimePoint{} && now < earlier + 2 * settle_time();
    }
    /// True if it has the shape of the last reply and follows soon: perhaps another panel with the
    /// same address.
    bool is_second(TimePoint now, ByteView reply) const {
        const Slot& slot = last();
        return slot.is_recent(now) && reply.size() == slot.reply.size() &&
               reply[0] == slot.reply[0];
    }
    /// A good frame came that was neither requested nor outstanding.
    void on_unasked(TimePoint now, ByteView reply) {
        const TimePoint earlier = earlier_reply_at(now, reply);
        if (earlier != TimePoint{}) return learn(now, now - earlier);
        if (!is_second(now, reply)) return;
        slots_[last_index()].second = true;
        if (std::ranges::count_if(slots_, &Slot::second) >= 2) learn(now, now - last().at);
    }
    /// Returns a recent reply that occurs again, as a good frame, inside damaged bytes; or nullptr.
    const Bytes* duplicate_in(TimePoint now, std::uint8_t station, ByteView bytes,
                              modbus::CrcOrder order = modbus::CrcOrder::low_first) const {
        for (const Slot& slot : slots_) {
            if (!slot.is_recent(now)) continue;
            const Bytes earlier = modbus::encode_adu(station, slot.reply, order);
            if (!std::ranges::search(bytes, earlier).empty()) return &slot.reply;
        }
        return nullptr;
    }
    /// The frame repeats a recent reply, or is an outstanding one with the same values: it is
    /// ambiguous.
    void on_ambiguous(TimePoint now, ByteView reply) {
        const TimePoint earlier = earlier_reply_at(now, reply);
        if (earlier != TimePoint{}) on_doubt((now - earlier) * 3 / 2);
    }
    /// After the next reply the station rests for `wait`, once: a duplicate may follow.
    void on_doubt(Duration wait) { doubt_ = std::max(doubt_, wait); }
    /// True if the station has sent duplicates lately.
    bool known() const { return settle_time() > Duration::zero(); }
    /// True if this answer repeats the answer to another request, or, after a proven duplicate, any
    /// earlier one, and the station has not yet shown that it gives equal answers.
    bool suspicious(TimePoint now, ByteView request, ByteView reply) const {
        if (confirmed_[kind_of(request, reply)].trusts(reply)) return false;
        const bool any = denied_ > 0 && now - denied_at_ <= timing::kForgetDuplicates;
        return any ? is_duplicate(now, reply) : repeats_other(now, request, reply);
    }
    /// True if this answer repeats a recent answer to another request.
    bool repeats_other(TimePoint now, ByteView request, ByteView reply) const {
        return std::ranges::any_of(slots_, [&](const Slot& slot) {
            return slot.is_recent(now) && std::ranges::equal(reply, slot.reply) &&
                   !std::ranges::equal(request, slot.request);
        });
    }
    /// The reply was no duplicate: a read had the same values when asked again; for any other
    /// request, which is not asked again, no other answer came.
    void on_confirmed(ByteView request, ByteView reply) {
        confirmed_[kind_of(request, reply)].add(reply);
        denied_ = 0;
    }
    /// A reply at `at` repeated an earlier one, and the station answered differently when asked
    /// again. The value may have just changed: three times in a row it is a duplicate.
    void on_denied(TimePoint at, ByteView reply) {
        confirmed_ = {};
        denied_ = at - denied_at_ <= timing::kForgetDuplicates ? denied_ + 1 : 1;
        denied_at_ = at;
        const TimePoint earlier = earlier_reply_at(at, reply, at);
        if (denied_ >= kDenials && earlier != TimePoint{}) learn(at, at - earlier);
    }
    /// With nothing outstanding, one request got this reply at `first` and again now: one of them
    /// is a duplicate: of the other, if that is how late this station's duplicates come, else
    /// perhaps of an earlier reply.
    void on_repeated_reply(TimePoint now, TimePoint first, ByteView reply) {
        if (now - first > timing::kLatestRepetition) return;
        if (known() && now - first <= settle_time()) return learn(now, now - first);
        const TimePoint earlier = earlier_reply_at(first, reply);
        learn(now,
              std::max(now - first, earlier == TimePoint{} ? Duration::zero() : first - earlier));
    }
    /// Time for which the station is not asked after a reply.
    Duration settle_time() const { return learned_ * 3 / 2; }
    /// ... after this reply, including the doubtful cases.
    Duration take_doubt() {
        return std::max(settle_time(), std::exchange(doubt_, Duration::zero()));
    }
    /// End of the rest after the last reply.
    TimePoint rest_until() const { return last().at + learned_ * 5 / 4; }

  private:
    struct Slot {
        TimePoint at{};
        Bytes request;
        Bytes reply;
        bool second = false;  ///< a frame of the same shape followed it
        bool is_recent(TimePoint now) const {
            return !reply.empty() && now - at <= timing::kLatestRepetition;
        }
    };
    /// Values are trusted separately: two writes to one address have equal answers, and so do many
    /// exceptions.
    static std::size_t kind_of(ByteView request, ByteView reply) {
        return request[0] <= 4 && reply[0] == request[0] ? 0 : 1;
    }
    std::size_t last_index() const { return (next_ + kReplies - 1) % kReplies; }
    const Slot& last() const { return slots_[last_index()]; }
    /// When it last sent this reply, before `before`; TimePoint{}: not recently.
    TimePoint earlier_reply_at(TimePoint now, ByteView reply,
                               TimePoint before = TimePoint::max()) const {
        TimePoint earlier{};
        for (const Slot& slot : slots_) {
            if (slot.at < before && slot.is_recent(now) && std::ranges::equal(reply, slot.reply))
                earlier = std::max(earlier, slot.at);
        }
        return earlier;
    }
    void learn(TimePoint now, Duration delay) {
        learned_ = std::max(learned_, delay);
        learned_at_ = now;
        confirmed_ = {};
    }

    std::array<Slot, kReplies> slots_{};
    std::size_t next_ = 0;
    std::array<EqualAnswers, 2> confirmed_;  ///< by kind_of()
    TimePoint denied_at_{};
    int denied_ = 0;  ///< in a row
    Duration doubt_{};
    Duration learned_{};  ///< from a reply to its duplicate
    TimePoint learned_at_{};
};

}  // namespace panelgate::arbiter
