#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt/attempt.hpp"
#include "panelgate/arbiter/book/judge.hpp"
#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/announced_replies.hpp"
#include "panelgate/arbiter/habits/duplicates.hpp"
#include "panelgate/arbiter/habits/known_reads.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// How one station answers: how long its replies may still come, whether in order, twice, or to
/// broadcasts, and which reads tell. With the line's book of requests it decides when the station
/// may be asked, and what a frame of it may be (P1). Pure.
class ReplyHabits {
  public:
    explicit ReplyHabits(const StationSettings& settings)
        : id_(settings.id), late_(settings.late_window, settings.response_timeout) {}
    /// Keeps what was learned; a rest that has begun is not shortened.
    void apply(const StationSettings& settings) {
        late_.apply(settings.late_window, settings.response_timeout);
    }
    const LearnedReads& reads() const { return reads_; }

    // Admission

    /// Time from which this request may be sent. One with another function, length or address is
    /// unambiguous and need not wait. `again`: it is a retry, which its own earlier attempts may
    /// answer.
    TimePoint clear_at(const OutstandingRequests& book, const modbus::Request& request,
                       bool again = false) const {
        if (again && (book.is_only(id_, request.pdu()) || book.came_damaged(id_, request.pdu())))
            return drained_at_;
        const bool ambiguous = book.is_ambiguous(id_, request, again);
        return std::max(drained_at_, ambiguous ? rested() : not_before_);
    }
    /// Time from which any request may be sent.
    TimePoint rested() const { return std::max({not_before_, until_, drained_at_}); }
    /// How long after a request has left its reply may still come.
    Duration latest_reply() const { return late_.timeout() + late_.value(); }
    Duration worst_lateness() const { return late_.worst(); }
    /// How long after a broadcast the station may answer it, which is wrong: its longest usual
    /// time; if it has done so, the window of any reply, or somewhat longer than that took.
    Duration broadcast_window(Duration usual) const {
        return broadcast_.delay
                   ? std::max(latest_reply(), *broadcast_.delay * 5 / 4 + timing::kBroadcastMargin)
                   : usual + late_.worst();
    }
    /// True if it has answered one with an exception.
    bool refuses_broadcasts() const { return broadcast_.refused; }
    /// True if a reply so long after a broadcast that it would fit may be the answer to that: it
    /// was neither seen to answer one, which is waited for, nor to answer none.
    bool may_answer_broadcast(std::optional<Duration> behind) const {
        return behind && !broadcast_.none && !broadcast_.delay && *behind <= latest_reply();
    }
    /// True if it has answered every request since the line was reopened: then no reply is in
    /// transit, even if outstanding ones look the same.
    bool answered_since_reopen() const { return reconnect_.answered(); }
    /// The probe, or a read of another length, which no outstanding reply fits except an exception:
    /// a station serves in order, so its answer shows that no earlier reply can still come.
    /// Alternates while unanswered.
    modbus::Request proof(const OutstandingRequests& book) const;
    /// True if sending proof() is quicker than waiting. False after an unanswered proof, until the
    /// station has answered something.
    bool may_prove(const OutstandingRequests& book) const {
        return book.any(id_) && !book.any_announced(id_) && !disordered_at_ &&
               book.first_sent(id_) >= book.opened() && reads_.any() && !proof_unanswered_ &&
               !book.is_ambiguous(id_, proof(book));
    }
    /// The pause that a station known to send duplicates needs after a reply, at most `longest`;
    /// empty: none.
    TimePoint duplicates_until(Duration longest) const {
        const bool known = duplicates_.known() && duplicates_.settle_time() <= longest;
        return known ? duplicates_.rest_until() : TimePoint{};
    }

    // Acceptance

    /// How long an answer is held, because the station sends two that differ; 0: it does not.
    Duration holds_answers(TimePoint now) const { return duplicates_.hold(now); }
    /// True if it was just seen not to serve in order.
    bool is_disordered() const { return disordered_at_.has_value(); }
    /// What this frame may be: none that answers the attempt, if there is one.
    Claims claims(const OutstandingRequests& book, TimePoint now, ByteView pdu,
                  const Attempt* attempt = nullptr) const;
    /// The facts of a frame that answers no open request. `pdu`: without address and CRC.
    Facts facts(const OutstandingRequests& book, TimePoint now, ByteView pdu) const;
    /// True if this exception may be for a request of another function than it names, or repeats a
    /// recent unsolicited one: asking again decides.
    bool may_refuse_other(const OutstandingRequests& book, TimePoint now, const Claims& claims,
                          std::uint8_t function) const {
        return claims.repeats_refusal || (now < until_ && book.has_other_function(id_, function));
    }
    /// True if it may be a duplicate: it repeats a reply, and duplicates come from this station, or
    /// it has not yet shown that it gives equal answers to different requests, or it came `early`
    /// or `quicker` than ever, or is a refusal behind a collision. A doubted reply that comes again
    /// is no duplicate.
    bool may_be_duplicate(TimePoint now, const Attempt& attempt, const Claims& claims, bool early,
                          bool quicker) const;
    /// True if this confirmation may be the last one of its function once more: in the last
    /// `within` the station has said one instead of another's, which that did not fit.
    bool may_repeat_confirmation(TimePoint now, ByteView reply,
                                 Duration within = timing::kForgetHabit) const {
        return repeated_at_ && now <= *repeated_at_ + within && is_last_confirmation(reply);
    }
    /// The write of other values that had this confirmation just before, where copies may come from
    /// this station; null: none. A read tells whether the place still holds those.
    const BookEntry* earlier_write(const OutstandingRequests& book, TimePoint now, ByteView write,
                                   ByteView confirmation) const;
    /// Time of the latest request that this reply proves to have reached the station: an attempt
    /// started at `started`, or the first outstanding one that the reply fits.
    TimePoint surely_answered(const OutstandingRequests& book, TimePoint started,
                              ByteView reply) const {
        const BookEntry* const other = book.first(id_, reply);
        return other != nullptr ? std::min(other->sent, started) : started;
    }
    /// Not before this was sampled what answers the group now: an equal request of before may have
    /// this reply.
    TimePoint sampled(const OutstandingRequests& book, TimePoint now, const Group& group) const {
        const auto first = book.first_asked(id_, group.request.pdu(), now - latest_reply());
        return std::min(group.started, first.value_or(group.started));
    }

    // Events

    /// A request is sent. Clears what cannot come any more, unless `in_transit`: then it may still
    /// come at any time.
    void on_asked(OutstandingRequests& book, TimePoint now, const Group& group, bool in_transit);
    /// What clients want of a station that has never answered.
    void on_wanted(const modbus::Request& request) { reads_.on_wanted(request); }
    /// An attempt that left at `sent` ended without its own reply: one more is outstanding, until
    /// it has come or cannot come any more.
    /// `announced`: by an exception.
    void on_unanswered(OutstandingRequests& book, TimePoint now, const Bytes& pdu, TimePoint sent,
                       bool announced = false);
    /// ... but for a reply that may be a duplicate of an earlier one; a duplicate of this
    /// one may follow.
    void on_doubted(OutstandingRequests& book, TimePoint now, const Group& group, TimePoint sent);
    /// True if all requests that it was asked again had two answers that differ.
    bool answers_twice() const { return duplicates_.answers_twice(); }
    /// A read has shown whether the reply was true to a request that is not repeated.
    void on_checked(const OutstandingRequests& book, const Group& check, bool was_true) {
        judge_doubted(book, check.written, check.confirms, check.doubted_at, was_true);
    }
    /// Two answers came that differ; the request is asked again. `again`: not the first time.
    void on_contradicted(TimePoint now, bool again) { duplicates_.on_contradicted(now, again); }
    /// ... but its reply came damaged. Some panels resend it: until that would be over only the
    /// same request may be sent, and after its answer the same rest applies.
    void on_damaged_reply(OutstandingRequests& book, TimePoint now, const modbus::Request& request,
                          TimePoint sent);
    /// A read that no client asked for was unanswered; `distinct_length`: a proof() whose failure
    /// says nothing about health.
    void on_probe_unanswered(bool distinct_length) {
        reconnect_.on_probe_unanswered(distinct_length);
        proof_unanswered_ = proof_unanswered_ || distinct_length;
    }
    /// An attempt was answered; `waited`: from the end of the request to the first sign of it.
    void on_answered(OutstandingRequests& book, TimePoint now, const Attempt& attempt,
                     Duration waited);

    struct Heard {
        Duration lateness{};             ///< of a late reply, after its response timeout
        std::optional<Duration> needed;  ///< of one that came within it, after a shortened wait
        bool at_least = false;           ///< that, as it is to the last request that it fits
        bool settled = false;            ///< no reply is outstanding any more
    };
    /// A good frame came that is no answer, and was judged. `asked`: a request to it is on the
    /// wire, which this does not answer.
    Heard on_unsolicited(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu,
                         bool asked);
    /// A frame came that equals a recent reply and may be our own, or a reply sooner than computed.
    void on_perhaps_copied(TimePoint now) { duplicates_.on_perhaps(now); }
    /// Damaged bytes were heard.
    void on_damaged_bytes(const OutstandingRequests& book, TimePoint now, ByteView bytes,
                          modbus::CrcOrder order);
    /// It has answered a broadcast, which is wrong, so long after it.
    void on_broadcast_answered(Duration delay, bool refused) {
        broadcast_.refused = broadcast_.refused || refused;
        broadcast_.delay = std::max(broadcast_.delay.value_or(delay), delay);
    }
    /// A broadcast was not answered: what came was the answer to a write.
    void on_broadcast_unanswered() { broadcast_.none = true; }
    /// The line was reopened, on a transport that may stall. Outstanding requests may be sent, and
    /// answered, only now: the station rests for that. `usual`: its longest usual time.
    void on_opened(const OutstandingRequests& book, TimePoint now, Duration usual);
    /// The transport was proved free now by a request that left at `sent`: earlier outstanding
    /// requests may only now have reached the station.
    void on_proved(const OutstandingRequests& book, TimePoint now, TimePoint sent);

    static constexpr int kClosedMemory = 8;  ///< response timeouts

  private:
    void remember_confirmation(const Bytes& reply);
    bool is_last_confirmation(ByteView pdu) const {
        return std::ranges::any_of(confirmations_,
                                   [&](const Bytes& one) { return std::ranges::equal(one, pdu); });
    }
    void rest(const OutstandingRequests& book, TimePoint now);
    void rest_is_over(TimePoint not_before);
    Heard on_late(OutstandingRequests& book, TimePoint now, ByteView pdu, bool asked,
                  bool may_repeat);
    Heard on_disorder(OutstandingRequests& book, TimePoint now, ByteView pdu);
    void on_unasked(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu);
    void close(OutstandingRequests& book, ByteView reply, bool asked);
    void judge_doubted(const OutstandingRequests& book, ByteView request, const Bytes& doubted,
                       TimePoint at, bool was_true);
    void learn_of_duplicates(OutstandingRequests& book, TimePoint now, const Attempt& attempt);
    void remember(OutstandingRequests& book, TimePoint now, const Bytes& pdu, ByteView reply) {
        duplicates_.on_reply(now);
        book.on_reply(id_, now, pdu, reply);
    }
    bool follows_refusal(const OutstandingRequests& book, TimePoint now, ByteView pdu) const;
    void settle(OutstandingRequests& book, TimePoint now, const Attempt& attempt);

    std::uint8_t id_;
    LateWindow late_;
    DuplicateHabit duplicates_;
    ReconnectState reconnect_;
    LearnedReads reads_;
    struct {
        std::optional<Duration> delay;  ///< the longest, of its answers
        bool refused = false;
        bool none = false;  ///< one had no answer
    } broadcast_;
    /// The last one of each function whose writes are longer: 15, 16, 23.
    std::array<Bytes, 3> confirmations_;
    std::optional<TimePoint> repeated_at_;  ///< when that came instead of another write's
    TimePoint not_before_{};                ///< duplicates may come, or the line was just opened
    TimePoint until_{};                     ///< outstanding replies may come; {}: none are
    TimePoint again_until_{};               ///< it may resend the damaged reply until then
    /// When it last answered a request after a later one: order closes nothing, and proves nothing,
    /// for timing::kForgetHabit after that.
    std::optional<TimePoint> disordered_at_;
    TimePoint drained_at_{};  ///< nothing is sent before, behind a disorder: answers are one behind
    bool proof_unanswered_ = false;  ///< since it was last heard
    AnnouncedReplies announced_;
    bool proved_ = false;  ///< no outstanding request is in transit
};

}  // namespace panelgate::arbiter
