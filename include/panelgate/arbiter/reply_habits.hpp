#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/book/judge.hpp"
#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

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
/// occur twice, because other stations send too. Forgotten some minutes after it stopped. The
/// replies themselves are in the book: `repeated` is when the one came that this one repeats, {} if
/// it repeats none. Pure.
class DuplicateHabit {
  public:
    static constexpr int kConfirmations = EqualAnswers::kEnough;
    static constexpr int kDenials = 3;  ///< after which they count as duplicates

    void on_reply(TimePoint now) {
        if (now - learned_at_ > timing::kForgetDuplicates) learned_ = guessed_ = {};
        replied_ = now;
    }
    /// True if it repeats a reply as soon as duplicates come from this station.
    bool repeats_itself(TimePoint now, TimePoint repeated) const {
        return repeated != TimePoint{} && now < repeated + 2 * settle_time();
    }
    /// A duplicate came so long after its reply.
    void learn(TimePoint now, Duration delay) {
        sooner_ = 2 * delay < guessed_ ? sooner_ + 1 : 0;
        if (sooner_ >= kConfirmations) guessed_ = {};
        learned_ = std::max(learned_, delay);
        learned_at_ = now;
        confirmed_ = {};
    }
    /// The reply that was given at `given` came once more. Directly behind another one it may
    /// follow that, and not the time: a guess again, until several in a row have come so.
    void on_copy(TimePoint now, TimePoint given, TimePoint last) {
        const Duration behind = std::max(now - last, timing::kReadingSlack);
        if (given == last || behind > timing::kShortestWait) return learn(now, now - given);
        const bool is_usual = known() && behind <= settle_time();
        learn(now, behind);
        if (is_usual) return;
        // A copy must still be known as one behind the rest that this brings.
        guessed_ = std::min(std::max(guessed_, now - given), timing::kLatestRepetition / 2);
        sooner_ = 0;
    }
    /// The frame repeats a recent reply, or is an outstanding one with the same values: it is
    /// ambiguous.
    void on_ambiguous(TimePoint now, TimePoint repeated) {
        if (repeated != TimePoint{}) on_doubt((now - repeated) * 3 / 2);
    }
    /// After the next reply the station rests for `wait`, once: a duplicate may follow.
    void on_doubt(Duration wait) { doubt_ = std::max(doubt_, wait); }
    /// True if the station has sent duplicates lately.
    bool known() const { return settle_time() > Duration::zero(); }
    /// True if this answer repeats the answer to another request, or, after a proven duplicate, any
    /// earlier one, and the station has not yet shown that it gives equal answers.
    bool suspicious(TimePoint now, ByteView request, ByteView reply, const Claims& claims) const {
        if (confirmed_[kind_of(request, reply)].trusts(reply)) return false;
        const bool any = denied_ > 0 && now - denied_at_ <= timing::kForgetDuplicates;
        return claims.repeats_other || (any && claims.repeats);
    }
    /// The reply was no duplicate: a read had the same values when asked again; for any other
    /// request, which is not asked again, no other answer came.
    void on_confirmed(ByteView request, ByteView reply) {
        confirmed_[kind_of(request, reply)].add(reply);
        denied_ = 0;
    }
    /// A reply at `at` repeated an earlier one, and the station answered differently when asked
    /// again. The value may have just changed: three times in a row it is a duplicate.
    void on_denied(TimePoint at, TimePoint repeated) {
        confirmed_ = {};
        denied_ = at - denied_at_ <= timing::kForgetDuplicates ? denied_ + 1 : 1;
        denied_at_ = at;
        if (denied_ >= kDenials && repeated != TimePoint{}) learn(at, at - repeated);
    }
    /// With nothing outstanding, one request got this reply at `first`, which `repeated` another,
    /// and again now: one of them is a duplicate: of the other, if that is how late this station's
    /// duplicates come, else perhaps of an earlier reply, and so much later: a guess, until several
    /// in a row have come in less than half of that.
    void on_repeated_reply(TimePoint now, TimePoint first, TimePoint repeated) {
        if (now - first > timing::kLatestRepetition) return;
        const bool is_usual = known() && now - first <= settle_time();
        learn(now, now - first);
        if (is_usual || repeated == TimePoint{}) return;
        guessed_ = std::max(guessed_, first - repeated);
        sooner_ = 0;
    }
    /// A second answer came so long after the first, and differs.
    void on_surplus(TimePoint now, Duration delay) {
        if (delay > timing::kLatestSurplus) return;
        if (now - surplus_at_ > timing::kForgetDuplicates) surplus_ = always_two_ = 0;
        surplus_delay_ = surplus_++ == 0 ? delay : std::max(surplus_delay_, delay);
        surplus_at_ = now;
    }
    void on_contradicted(TimePoint now, bool again) {
        surplus_at_ = now;
        if (again) on_asked_again(true);
    }
    /// Asked again, after a rest, it gave two answers, or one: where all requests have two, both
    /// are to the same one.
    void on_asked_again(bool two) { always_two_ = two ? always_two_ + 1 : 0; }
    /// All its requests have two answers.
    bool answers_twice() const { return always_two_ >= kAlwaysTwo; }
    /// How long an answer is to be held, because another one may follow that differs.
    Duration hold(TimePoint now) const {
        const bool known = surplus_ >= kSurplus && now - surplus_at_ <= timing::kForgetDuplicates;
        return known && !answers_twice() ? surplus_delay_ * 3 / 2 + timing::kReceiveMargin
                                         : Duration::zero();
    }
    /// Time for which the station is not asked after a reply.
    Duration settle_time() const { return delay() * 3 / 2; }
    /// ... after this reply, including the doubtful cases.
    Duration take_doubt() {
        return std::max(settle_time(), std::exchange(doubt_, Duration::zero()));
    }
    /// End of the rest after the last reply.
    TimePoint rest_until() const { return replied_ + delay() * 5 / 4; }

  private:
    Duration delay() const { return std::max(learned_, guessed_); }
    /// Values are trusted separately: two writes to one address have equal answers, and so do many
    /// exceptions.
    static std::size_t kind_of(ByteView request, ByteView reply) {
        return request[0] <= 4 && reply[0] == request[0] ? 0 : 1;
    }

    std::array<EqualAnswers, 2> confirmed_;  ///< by kind_of()
    TimePoint denied_at_{};
    int denied_ = 0;  ///< in a row
    Duration doubt_{};
    Duration learned_{};  ///< from a reply to its duplicate
    Duration guessed_{};  ///< ... if one was not that of the reply before
    int sooner_ = 0;      ///< duplicates in a row that came in less than half of that
    TimePoint learned_at_{};
    TimePoint replied_{};
    static constexpr int kSurplus = 2;
    static constexpr int kAlwaysTwo = 6;  ///< in a row
    int surplus_ = 0;
    int always_two_ = 0;  ///< in a row
    Duration surplus_delay_{};
    TimePoint surplus_at_{};
};

/// The reads that a station is known to answer: one of them tells whether it is there. Pure.
class KnownReads {
  public:
    void on_answered(const modbus::Request& read, const modbus::Span& span) {
        std::uint32_t& longest = longest_[static_cast<std::size_t>(span.table)];
        longest = std::max(longest, span.count);
        if (!cheapest_ || span.count < cheapest_->span()->count) cheapest_ = read;
        if (!largest_ || span.count > largest_->span()->count) largest_ = read;
    }
    /// What clients want of a station that has never answered: it may answer nothing else.
    void on_wanted(const modbus::Request& request) {
        if (request.span()) last_ = request;
    }
    bool any() const { return cheapest_.has_value(); }
    /// The cheapest that it has answered; else what was asked last.
    modbus::Request probe() const {
        if (cheapest_) return *cheapest_;
        return last_ ? *last_ : modbus::Request::read({modbus::Table::holding_registers, 0, 1});
    }
    /// The largest that it has answered; else the probe.
    modbus::Span largest() const { return largest_ ? *largest_->span() : *probe().span(); }
    /// Longest read of this table that it has answered, in items.
    std::uint32_t longest(modbus::Table table) const {
        return longest_[static_cast<std::size_t>(table)];
    }

  private:
    std::optional<modbus::Request> cheapest_;  ///< that it has answered
    std::optional<modbus::Request> largest_;   ///< that it has answered; so are parts of it
    std::optional<modbus::Request> last_;      ///< probe before it has answered any
    std::array<std::uint32_t, modbus::kTables.size()> longest_{};  ///< by table
};

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
    const KnownReads& reads() const { return reads_; }

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
    /// True if the answer repeats a recent reply and came `too_early`: the request may never have
    /// arrived.
    static bool is_impossible(const Attempt& attempt, const Claims& claims, bool too_early) {
        return too_early && attempt.group().attempts <= 1 && claims.repeats;
    }
    /// True if it may be a duplicate: it repeats a reply, and duplicates come from this station, or
    /// it has not yet shown that it gives equal answers to different requests, or it came `early`
    /// or `quicker` than ever, or is a refusal behind a collision. A doubted reply that comes again
    /// is no duplicate.
    bool may_be_duplicate(TimePoint now, const Attempt& attempt, const Claims& claims, bool early,
                          bool quicker) const;
    /// True if this confirmation may be the last one once more, said instead of its own: the
    /// station has done that with one that fitted no other write.
    bool may_repeat_confirmation(TimePoint now, ByteView reply) const {
        return repeated_at_ && now <= *repeated_at_ + timing::kForgetHabit &&
               std::ranges::equal(reply, confirmation_);
    }
    /// Time of the latest request that this reply proves to have reached the station: an attempt
    /// started at `started`, or the first outstanding one that the reply fits.
    TimePoint surely_answered(const OutstandingRequests& book, TimePoint started,
                              ByteView reply) const {
        const Asked* const other = book.first(id_, reply);
        return other != nullptr ? std::min(other->sent, started) : started;
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
        bool settled = false;            ///< no reply is outstanding any more
    };
    /// A good frame came that is no answer, and was judged. `asked`: a request to it is on the
    /// wire, which this does not answer.
    Heard on_unsolicited(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu,
                         bool asked);
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
    void rest(const OutstandingRequests& book, TimePoint now);
    void rest_is_over(TimePoint not_before);
    Heard on_late(OutstandingRequests& book, TimePoint now, ByteView pdu, bool asked,
                  bool may_repeat);
    Heard on_disorder(OutstandingRequests& book, TimePoint now, ByteView pdu);
    void on_unasked(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu);
    void close(OutstandingRequests& book, ByteView reply, bool asked);
    void learn_of_duplicates(OutstandingRequests& book, TimePoint now, const Attempt& attempt);
    void remember(OutstandingRequests& book, TimePoint now, const Bytes& pdu, ByteView reply) {
        duplicates_.on_reply(now);
        book.on_reply(id_, now, pdu, reply);
    }
    /// True if after this exception the reply itself may come.
    bool announces(ByteView reply) const;
    void settle(OutstandingRequests& book, TimePoint now, const Attempt& attempt);

    std::uint8_t id_;
    LateWindow late_;
    DuplicateHabit duplicates_;
    ReconnectState reconnect_;
    KnownReads reads_;
    struct {
        std::optional<Duration> delay;  ///< the longest, of its answers
        bool refused = false;
        bool none = false;  ///< one had no answer
    } broadcast_;
    Bytes confirmation_;                    ///< the last, of a write that is longer
    std::optional<TimePoint> repeated_at_;  ///< when that came instead of another write's
    TimePoint not_before_{};                ///< duplicates may come, or the line was just opened
    TimePoint until_{};                     ///< outstanding replies may come; {}: none are
    TimePoint again_until_{};               ///< it may resend the damaged reply until then
    /// When it last answered a request after a later one: order closes nothing, and proves nothing,
    /// for timing::kForgetHabit after that.
    std::optional<TimePoint> disordered_at_;
    TimePoint drained_at_{};  ///< nothing is sent before, behind a disorder: answers are one behind
    bool proof_unanswered_ = false;  ///< since it was last heard
    /// A busy panel usually does nothing: after so many exceptions 06 that no reply followed, none
    /// is waited for.
    static constexpr int kUnkept = 3;
    int unkept_ = 0;
    bool proved_ = false;  ///< no outstanding request is in transit
};

}  // namespace panelgate::arbiter
