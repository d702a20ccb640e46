#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

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
    /// A reply came again, or our own frame, which it equals.
    void on_perhaps(TimePoint now) { perhaps_at_ = now; }
    /// ... or may have.
    bool suspected(TimePoint now) const {
        return known() || (perhaps_at_ && now - *perhaps_at_ <= timing::kForgetDuplicates);
    }
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
        return modbus::returns_values(request) && reply[0] == request[0] ? 0 : 1;
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
    std::optional<TimePoint> perhaps_at_;
    static constexpr int kSurplus = 2;
    static constexpr int kAlwaysTwo = 6;  ///< in a row
    int surplus_ = 0;
    int always_two_ = 0;  ///< in a row
    Duration surplus_delay_{};
    TimePoint surplus_at_{};
};

}  // namespace panelgate::arbiter
