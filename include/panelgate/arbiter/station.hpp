#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt/attempt.hpp"
#include "panelgate/arbiter/book/judge.hpp"
#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/reply_habits.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// State of one station: how it answers, when it may be asked, how long to wait for it, and what
/// its failures may cost. What was asked of it is in the line's book. Pure.
class Station {
  public:
    /// `frame`: duration of a usual reply on this line.
    Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
            Duration frame = {});

    /// Applies new settings. Outstanding replies and what is known of the station are kept; a rest
    /// that has begun is not shortened.
    void apply(const StationSettings& settings, const OfflineSettings& offline, bool listed);

    /// How it answers (P1).
    const ReplyHabits& replies() const { return replies_; }
    ReplyHabits& replies() { return replies_; }

    // When it may be asked

    /// True if a waiting read goes before its writes: its last request was an unanswered write, or
    /// it has had four writes in a row (P9). Where it rests after each reply, other stations have
    /// the turns between, and its reads would have too few: then every other one.
    bool has_read_turn() const {
        return read_turn_ || writes_in_a_row_ >= (rests_after_replies() ? 1 : kWritesInARow);
    }
    /// True if a waiting poll goes before its reads: where it rests after each reply, polls of
    /// other stations have the turns of their class.
    bool has_poll_turn() const {
        return rests_after_replies() && polls_passed_over_ >= kPollsPassedOver;
    }
    /// True if it has answered reads and the last one too: failed writes do not postpone reads.
    bool answers_reads() const { return replies_.reads().any() && !read_missed_; }
    /// True if so many writes in a row failed that a read must check whether it is there.
    bool wants_check() const { return wants_check_; }
    /// True if sending a proof is quicker than waiting.
    bool may_prove(const OutstandingRequests& book) const {
        return !health_.offline() && replies_.may_prove(book);
    }
    /// True if it has answered its last request.
    bool is_answering() const { return !missed_ && health_.silent_in_a_row() == 0; }
    /// When its next probe may be sent: usually the probe is the outstanding request itself.
    TimePoint probe_due(const OutstandingRequests& book) const {
        const modbus::Request probe = replies_.reads().probe();
        if (wants_check_) return replies_.clear_at(book, probe);
        const bool is_only = book.is_only(id(), probe.pdu());
        return std::max(health_.next_probe(), is_only ? TimePoint{} : replies_.rested());
    }
    /// A request is sent; `in_transit`: what is outstanding may still come at any time.
    void on_asked(OutstandingRequests& book, TimePoint now, const Group& group,
                  bool in_transit = false);
    void on_line_down() { health_.on_line_down(); }
    /// The line was reopened, on a transport that may stall.
    void on_opened(const OutstandingRequests& book, TimePoint now) {
        replies_.on_opened(book, now, usual());
    }

    // Replies and failures

    using Heard = ReplyHabits::Heard;
    /// How long after a broadcast it may answer it.
    Duration broadcast_window() const { return replies_.broadcast_window(usual()); }
    /// A good frame came that is no answer, and was judged. `pdu`: without address and CRC.
    /// `asked`: a request to it is on the wire.
    Heard on_unsolicited_frame(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu,
                               bool asked = false);
    /// A reply of it came, late, or in pieces. True if it was offline.
    bool on_sign_of_life(TimePoint now);
    /// Unsolicited bytes followed its reply.
    void on_unsolicited_bytes(TimePoint now) { trail_.on_unsolicited(now); }

    struct Replied {
        Condition before = Condition::well;
        bool back = false;              ///< it was offline
        bool trailed = false;           ///< something followed the previous reply
        std::optional<Duration> drift;  ///< new: its replies come this near the response timeout
        std::optional<Duration> trail;  ///< new: this long something follows its replies
    };
    /// An attempt was answered. `waited`: from the end of the request to the first sign of the
    /// reply; `think`: without the silence by which the panel detects the end of the request.
    Replied on_reply(OutstandingRequests& book, TimePoint now, const Attempt& attempt,
                     Duration waited, Duration think);
    /// An answer that was doubted came so long after the request: the next one may.
    void on_doubted(Duration waited) { times_.add_long(waited); }
    /// The reply to a failed attempt broke off for so long.
    void on_broken_reply(TimePoint now, Duration pause) {
        hole_.on_broken(now, pause, settings_.response_timeout);
    }
    /// The silence inside its replies that is to be waited for; 0: as long as on the line.
    Duration reply_hole() const { return hole_.learned(); }
    /// An attempt that occupied the line for `cost` failed.
    void on_failed(TimePoint now, Verdict verdict, Duration cost,
                   const modbus::Request* write = nullptr);
    /// The whole transaction failed. Returns true if that took the station offline.
    bool on_given_up(TimePoint now, Fault fault, bool is_read = true);
    /// True if this answer may be a duplicate; `early`: it came before the request can have left.
    bool may_be_duplicate(TimePoint now, const Attempt& attempt, const Claims& claims,
                          bool early) const {
        const bool quicker = is_quicker_than_ever(attempt.first_sign(now));
        return replies_.may_be_duplicate(now, attempt, claims, early, quicker);
    }
    /// True if no recent reply began this soon after the request.
    bool is_quicker_than_ever(Duration first_sign) const {
        const auto shortest = times_.shortest();
        return shortest && first_sign < *shortest;
    }
    /// ... by a wide margin. `doubted`: it may be to another request, then fewer replies show it.
    bool is_far_too_quick(Duration first_sign, bool doubted = false) const {
        return times_.is_far_below(first_sign, doubted);
    }
    /// ... compared with the whole `line` if few replies of the station are known. Where few of
    /// that are, too: before the request had left, and none of them had.
    bool is_far_too_quick(Duration first_sign, const RecentTimes& line) const {
        if (times_.is_significant()) return is_far_too_quick(first_sign);
        if (line.is_significant()) return line.is_far_below(first_sign);
        return first_sign <= Duration::zero() && line.shortest() > Duration::zero();
    }
    /// ... later than ever, of one that may be to another request.
    bool is_slow(Duration begun) const { return times_.is_significant(true) && begun > usual(); }

    // How to ask it

    const StationSettings& settings() const { return settings_; }
    std::uint8_t id() const { return settings_.id; }
    const StationHealth& health() const { return health_; }
    /// Returns true if this client's request may be the probe, once per interval. A write that was
    /// ignored does not prevent a read from being the next one.
    bool take_half_open(TimePoint now, bool is_read);
    /// The worst that is true of it now.
    Condition condition() const;
    /// True if it is neither listed nor was ever heard: there may be no such station.
    bool speculative() const { return !listed_ && !health_.last_heard(); }
    bool forgettable(const OutstandingRequests& book, TimePoint now) const {
        return speculative() && !book.any(id()) && now >= asked_ + timing::kForgetUnheard;
    }
    /// True if it missed its last request, and is not offline yet.
    bool missed_last() const { return !is_answering() && !health_.offline(); }
    /// True if it fails repeatedly without being offline.
    bool failing() const { return failed_in_a_row_ >= kFailing && !health_.offline(); }
    /// True if so many recent attempts failed that another failure is expected.
    bool flaky() const { return std::popcount(lately_) >= kFlaky; }
    /// Time from which its failures are within its share of the line, with a credit for unforeseen
    /// ones.
    TimePoint affordable_at() const {
        const TimePoint paid = budget_.next() - kCredit * timeout_cost();
        return failing() ? std::max(paid, failing_.next()) : paid;
    }
    /// ... true if so now, also for the cost of a write that it ignored.
    bool may_spend(TimePoint now, const modbus::Request* write = nullptr) const {
        const bool was_ignored = write != nullptr && ignores(*write);
        return now >= affordable_at() &&
               (!was_ignored || writes_.allows(now, kCredit * timeout_cost()));
    }
    /// ... true while its share is exceeded: credit aside; of a write, whose need must be known,
    /// with credit.
    bool over_budget(TimePoint now, const modbus::Request& request) const {
        if (request.is_read()) return !budget_.allows(now);
        return slowest_write_ && !writes_.allows(now, kCredit * timeout_cost());
    }
    /// The whole line rests for `rest` because of it.
    void on_line_rests(TimePoint now, Duration rest) {
        spend(now, rest);
        if (failing()) failing_.add(rest);
    }
    /// An answer was kept since it `came`: it costs the others what a failure would, if that is
    /// because this station sends surplus ones.
    void on_kept(TimePoint now, TimePoint came) {
        if (replies_.holds_answers(now) > Duration::zero()) on_line_rests(now, now - came);
    }
    bool may_retry(const Group& group) const;
    /// Its request is retried; `silent`: after silence.
    void on_retry(bool silent) { missed_ = silent; }
    /// Time that the next attempt waits for its reply to begin. `line`: longest think time of all
    /// stations so far; `urgent`: others have just fallen silent, or it is over budget;
    /// `flaky_beside_others`: it fails so often that others should not wait longer than it usually
    /// needs.
    Duration patience(const Group& group, std::optional<Duration> line, bool urgent,
                      bool flaky_beside_others = false) const;
    /// Its longest recent time plus a margin, at most its response timeout. For a station never
    /// heard that of the `line`, if known.
    Duration usual(std::optional<Duration> line = {}, bool is_write = false) const;
    /// ... without that margin, except for receiver buffering.
    Duration needed() const {
        return slowest().value_or(settings_.response_timeout) + timing::kCandidateMargin;
    }
    /// From the end of a request to the beginning of its reply. Adaptive: the floor and twice the
    /// time that 98 of 100 replies needed, doubled after each timeout in a row; as configured at
    /// most, and until enough is known.
    Duration response_timeout() const;
    /// True if its last replies were as requested: no exceptions, no damage.
    bool answers_as_asked() const { return unusual_ == 0; }
    const Drift& clock_drift() const { return clock_drift_; }
    /// Time until which the line should rest because of what follows its replies.
    TimePoint trail_until() const {
        return std::max(trail_.until(), replies_.duplicates_until(trail_.longest()));
    }
    std::optional<Duration> slowest() const { return times_.longest(); }

    /// End of its last failed attempt.
    TimePoint failed() const { return failed_; }
    /// A client wants this unheard station, which is not asked now.
    void on_wanted(TimePoint now) { asked_ = now; }

    static constexpr int kFailing = 2;          ///< failed transactions in a row
    static constexpr int kFlaky = 4;            ///< silent ones of the last 8 attempts
    static constexpr int kUnusualReplies = 16;  ///< replies until an exception is unexpected again
    static constexpr int kWritesInARow = 4;     ///< while a read waits for it
    static constexpr int kPollsPassedOver = 3;  ///< while a poll waits for it
    static constexpr int kCredit = 2;           ///< whole timeouts of credit
    static constexpr int kBudgetMemory = 3;     ///< failures, or whole timeouts, that it remembers

  private:
    /// Time in which its share of the line covers this cost.
    static Duration paid_in(Duration cost) {
        return static_cast<int>(1 / ProbeBudget::kFailing) * cost;
    }
    /// ... one whole timeout.
    Duration timeout_cost() const { return paid_in(settings_.response_timeout); }
    /// Twice the time that this share of its replies take. At low rates the silence behind the
    /// request and the first character take longer than the panel: once is as long as it takes to
    /// see any.
    Duration twice_what_take(double share) const;
    bool rests_after_replies() const {
        return replies_.duplicates_until(Duration::max()) != TimePoint{};
    }
    void spend(TimePoint now, Duration cost, bool of_reads = true) {
        const Duration most = kBudgetMemory * std::max(timeout_cost(), paid_in(cost));
        (of_reads ? budget_ : writes_).spend(now, cost, most);
    }
    /// True if it has not answered a write there, or of any sort: to several places in a row.
    bool ignores(const modbus::Request& write) const {
        return is_ignored(write) || ignored_places_ > 1;
    }
    /// True if its last unanswered write was to the same address.
    bool is_ignored(const modbus::Request& write) const {
        const auto place = [](const Bytes& pdu) {
            return ByteView(pdu).first(std::min<std::size_t>(pdu.size(), 3));
        };
        return std::ranges::equal(place(write.pdu()), place(ignored_));
    }

    StationSettings settings_;
    bool listed_;
    ReplyHabits replies_;
    StationHealth health_;
    Turnaround turnaround_;
    Trail trail_;
    ProbeBudget budget_{ProbeBudget::kFailing};   ///< of failures; replies do not reduce it
    ProbeBudget writes_{ProbeBudget::kFailing};   ///< ... but of silent writes, apart from reads
    ProbeBudget failing_{ProbeBudget::kFailing};  ///< of failures while it is failing()
    std::uint8_t lately_ = 0;  ///< the last 8 attempts, latest lowest: 1 was silent
    TimePoint asked_{};
    RecentTimes times_;                      ///< from request to first sign of the reply
    RecentTimes times_before_;               ///< without the last reply
    std::optional<Duration> slowest_write_;  ///< ever: there may be few
    TimePoint failed_{};
    Drift clock_drift_;
    ReplyHole hole_;
    int failed_in_a_row_ = 0;
    int unusual_ = 0;         ///< replies left until answers_as_asked()
    bool missed_ = false;     ///< the last attempt was silent, and its retry has not ended
    Bytes ignored_;           ///< the last write that it did not answer
    int ignored_places_ = 0;  ///< that it did not answer a write to, in a row
    bool read_turn_ = false;
    int writes_in_a_row_ = 0;
    int polls_passed_over_ = 0;  ///< its turns since its last poll
    bool read_missed_ = false;   ///< the last read was unanswered
    bool wants_check_ = false;
    bool woken_by_write_ = false;  ///< its last probe was a client's write
    int probes_ = 0;               ///< unanswered, since it was last heard
};

}  // namespace panelgate::arbiter
