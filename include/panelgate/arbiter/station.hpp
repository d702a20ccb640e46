#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/copy_guard.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// What a good frame of a station is that nobody waits for.
enum class Stray : std::uint8_t {
    late,     ///< a reply that was owed
    copy,     ///< the reply taken last, once more
    second,   ///< another one of its shape behind it: two panels with one address
    unasked,  ///< anything else
};

/// What one panel owes, when it may be asked, how long it is waited for, and what a stray frame of
/// it is. It owns these states: each changes in its verbs only. Pure.
class Station {
  public:
    /// `frame`: what a usual reply takes on this line.
    Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
            Duration frame = {});

    /// It is asked otherwise from now on, or is (no more) listed. What it owes and what is known of
    /// it stay; a rest that has begun is not cut short.
    void apply(const StationSettings& settings, const OfflineSettings& offline, bool listed);

    // What it owes (P1)

    /// An attempt that left at `sent` ended without its own reply: one more is owed, until it has
    /// come or cannot come any more.
    void owe(TimePoint now, const Bytes& pdu, TimePoint sent);
    /// ... but its reply has come, damaged. Some say such a one once more: until that would be over
    /// only the very same request may go there, and behind its answer the same holds.
    void on_damaged_reply(TimePoint now, const modbus::Request& request, TimePoint sent);
    bool owes() const { return !debt_.empty(); }
    /// From then on any request may go there.
    TimePoint rested() const { return std::max(not_before_, outstanding_until_); }
    /// From then on this request may: nothing that is outstanding could be taken for its answer.
    /// Another function, length or place is unambiguous and need not wait. `again`: it is repeated.
    TimePoint clear_at(const modbus::Request& request, bool again = false) const {
        if (again && (request.pdu() == damaged_pdu_ || debt_.is_only(request.pdu()))) return {};
        return is_ambiguous(request, again) ? rested() : not_before_;
    }
    /// A normal reply that is outstanding could be taken for that to this request. A refusal may be
    /// of any request of the same function (refuses_other()).
    bool is_ambiguous(const modbus::Request& request, bool again = false) const {
        return debt_.is_ambiguous(request, again);
    }
    /// What it was asked last was a write that it did not answer: a read that waits goes next.
    bool has_read_turn() const { return read_turn_; }
    /// It answers reads, as far as anybody has seen: what writes cost is no reason to put them off.
    bool answers_reads() const { return cheapest_read_ && !read_missed_; }
    /// So many writes in a row were in vain that a read is to tell whether it is there.
    bool wants_check() const { return wants_check_; }
    /// It is there and serves in turn, so that the answer to proof() shows that nothing which was
    /// asked before can still come: asking for that is quicker than to wait. Not again after one
    /// was in vain, until it has answered something.
    bool may_prove() const {
        return owes() && debt_.first_sent() >= connected_ && cheapest_read_ && !proof_in_vain_ &&
               !health_.offline() && !is_ambiguous(proof());
    }
    /// It has answered what it was asked last.
    bool is_answering() const { return !missed_ && health_.silent_in_a_row() == 0; }
    /// Of a request: how long after it has left a reply may still come.
    Duration latest_reply() const { return settings_.response_timeout + late_.value(); }
    /// When its next probe may go: as a rule it is the request that is owed.
    TimePoint probe_due() const {
        if (wants_check_) return clear_at(probe());
        return std::max(health_.next_probe(),
                        debt_.is_only(probe().pdu()) ? TimePoint{} : rested());
    }
    /// A request goes there, and what was owed before has lapsed if it could not come any more.
    /// `held_back`: it may still be on its way, whatever the time.
    void on_asked(TimePoint now, const Group& group, bool held_back = false);
    /// It owes a reply to a request that left at `since` or later. Where that is when the way to
    /// the wire was proved last, nothing proves the request to have passed.
    bool owes_since(TimePoint since) const { return owes() && debt_.last_sent() >= since; }
    /// This refusal of a request may be one of another that is outstanding.
    bool refuses_other(ByteView reply, const Bytes& pdu) const {
        return debt_.fits_other(reply, pdu);
    }
    /// ... as some panels refuse with another function's number, or once more what it said unasked
    /// a moment ago: asking again tells.
    bool may_refuse_other(TimePoint now, ByteView reply, std::uint8_t function) const {
        return is_stray_refusal(now, reply) ||
               (now < outstanding_until_ && debt_.has_other_function(function));
    }
    /// It has answered all that it was asked since the line was opened anew, the rest is over, and
    /// nothing more has come: no reply is on its way, though none could be told from those owed.
    bool has_returned() const { return return_.answered(); }
    /// What this reply to an attempt that was started then proves: that a request of that moment
    /// has reached the station. Where another is owed that it fits as well, the first such one.
    TimePoint surely_answered(TimePoint started, ByteView reply) const;
    void on_line_down() { health_.on_line_down(); }
    /// The line is open again. What is owed may be sent, and answered, just now: whoever speaks
    /// meanwhile is not understood.
    void on_opened(TimePoint now);
    /// The way to the wire was proved free now, by a request that left at `sent`: what was owed
    /// from before may only now have reached the station.
    void on_proved(TimePoint now, TimePoint sent);

    // What comes of it

    struct Heard {
        Stray stray = Stray::unasked;
        Duration lateness{};   ///< of a late one, behind its response timeout
        bool back = false;     ///< it was offline
        bool settled = false;  ///< it owes nothing any more
    };
    /// It has answered a broadcast.
    void on_broadcast_answered() { answers_broadcasts_ = true; }
    /// How long after a broadcast it may do so: as long as it has ever needed. Who does it is
    /// trusted no more than with any reply that it owes.
    Duration broadcast_window() const {
        return answers_broadcasts_ ? settings_.response_timeout + late_.value()
                                   : usual() + late_.worst();
    }
    /// The one judge of stray frames. `pdu`: without address and CRC.
    Heard on_stray_frame(TimePoint now, ByteView pdu);
    /// What on_stray_frame() would say; changes nothing.
    Stray judge(TimePoint now, ByteView pdu) const;
    /// Bytes of nobody behind its reply.
    void on_stray_bytes(TimePoint now) { trail_.on_stray(now); }

    /// Bytes that are no frame; `id`: its own address.
    void on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes);

    struct Replied {
        bool back = false;              ///< it was offline
        bool trailed = false;           ///< something stood behind the reply before
        std::optional<Duration> drift;  ///< news: it has come that near its response timeout
        std::optional<Duration> trail;  ///< news: so much always stands behind its replies
    };
    /// Its answer to an attempt. `waited`: from the end of the request to its first sign;
    /// `think`: without the silence that tells the panel that the request is over.
    Replied on_reply(TimePoint now, const Attempt& attempt, Duration waited, Duration think);
    /// An attempt failed that kept the line for `cost`.
    void on_failed(TimePoint now, Verdict verdict, Duration cost,
                   const modbus::Request* write = nullptr);
    /// A read for nobody was in vain; `told_apart`: such a proof(), which tells nothing of its
    /// health.
    void on_in_vain(bool told_apart) {
        return_.on_in_vain(told_apart);
        proof_in_vain_ = proof_in_vain_ || told_apart;
    }
    /// The whole transaction failed. True when that took it offline.
    bool on_given_up(TimePoint now, Fault fault, bool is_read = true);
    /// This answer repeats an earlier reply, soon, and it came `too_early`: the request may never
    /// have got through.
    bool is_copy(TimePoint now, const Attempt& attempt, bool too_early) const {
        const bool again = attempt.group().attempts > 1;
        return too_early && !again && copies_.is_copy(now, attempt.reply());
    }
    /// It repeats one, and copies come from this station, or it has not shown yet that it gives
    /// equal answers to different requests, or it came `early`. What was doubted and comes again is
    /// no copy.
    bool may_be_copy(TimePoint now, const Attempt& attempt, bool early) const {
        const Group& group = attempt.group();
        if (attempt.was_held() || attempt.reply() == group.doubted) return false;
        const Bytes& pdu = group.request.pdu();
        return is_copy(now, attempt, early) || copies_.repeats_itself(now, attempt.reply()) ||
               copies_.suspicious(now, pdu, attempt.reply()) ||
               (is_quicker_than_ever(attempt.first_sign(now)) &&
                copies_.repeats_other(now, pdu, attempt.reply()));
    }
    /// None of its latest replies has begun so soon after the request.
    bool is_quicker_than_ever(Duration first_sign) const {
        const auto quickest = quickest_.value();
        return quickest && first_sign < *quickest;
    }
    /// ... and by far; of one that was not heard often the same of the others of the `line`.
    bool is_far_too_quick(Duration first_sign, const Quickest& line) const {
        const Quickest& seen = quickest_.known() ? quickest_ : line;
        return seen.known() && first_sign < *seen.value() * 3 / 4;
    }

    // How it is to be asked

    const StationSettings& settings() const { return settings_; }
    const StationHealth& health() const { return health_; }
    /// A client's request may be the probe, once an interval. A write that was ignored does not
    /// keep reads from being the next one.
    bool take_half_open(TimePoint now, bool is_read);
    /// Nobody listed it, and nobody has ever heard it.
    bool stranger() const { return !listed_ && !health_.last_heard(); }
    bool forgettable(TimePoint now) const {
        return stranger() && !owes() && now >= asked_ + kForgetStranger;
    }
    /// It has just fallen silent, and is not offline yet.
    bool suspect() const {
        return (missed_ || health_.silent_in_a_row() > 0) && !health_.offline();
    }
    /// It fails again and again, and is not silent.
    bool failing() const { return failed_in_a_row_ >= kFailing && !health_.offline(); }
    /// So many of its last attempts were in vain that another one would surprise nobody.
    bool flaky() const { return std::popcount(lately_) >= kFlaky; }
    /// What its failures took of the bus is within its share from then on, but for the odd one that
    /// nobody could foresee.
    TimePoint affordable_at() const {
        const TimePoint paid = budget_.next() - kCredit * timeout_cost();
        return failing() ? std::max(paid, failing_.next()) : paid;
    }
    /// ... is so now; and so is what a write took that it ignored.
    bool may_spend(TimePoint now, const modbus::Request* write = nullptr) const {
        const bool was_ignored = write != nullptr && is_ignored(*write);
        return now >= affordable_at() &&
               (!was_ignored || writes_.allows(now, kCredit * timeout_cost()));
    }
    /// ... and all of it is paid.
    bool in_debt(TimePoint now) const { return !budget_.allows(now); }
    /// The whole line rests for so long because of it.
    void on_line_rests(TimePoint now, Duration rest) {
        spend(now, rest);
        if (failing()) failing_.add(rest);
    }
    bool may_retry(const Group& group) const;
    /// Its request goes again, behind silence or not: until that is over nobody is surprised.
    void on_retry(bool silent) { missed_ = silent; }
    /// How long the next attempt waits for its reply to begin. `line`: the longest think time of
    /// all stations of the line so far; `hurry`: others have just fallen silent, and waited for.
    /// `spent`: it has failed so often that others are not to pay for more than it has needed.
    Duration patience(const Group& group, std::optional<Duration> line, bool hurry,
                      bool spent = false) const;
    /// What it has needed, and some more; at most its response timeout. Of one that was never heard
    /// the same of the others of the `line`, if they were.
    Duration usual(std::optional<Duration> line = {}) const { return short_wait(line); }
    /// ... and not more than that, but for what a receiver holds back.
    Duration needed() const { return slowest().value_or(settings_.response_timeout) + 10ms; }
    Duration response_timeout() const { return timeout(); }
    /// Its last replies were what was asked for, no exceptions, and not damaged.
    bool answers_as_asked() const { return odd_ == 0; }
    const Drift& clock_drift() const { return clock_drift_; }
    modbus::Request probe() const;
    /// The same, or a read that differs from it in its length: no reply that is owed fits it, but
    /// for an exception. In turns, as long as it is in vain.
    modbus::Request proof() const;
    /// The longest read of this table that it has answered; items.
    std::uint32_t longest_read(modbus::Table table) const {
        return longest_read_[static_cast<std::size_t>(table)];
    }
    Duration worst_lateness() const { return late_.worst(); }
    /// Until when nobody should send, because of what follows its replies.
    TimePoint trail_until() const {
        const bool copies = copies_.known() && copies_.hold() <= trail_.longest();
        return std::max(trail_.until(), copies ? copies_.rest_until() : TimePoint{});
    }
    std::optional<Duration> slowest() const { return slowest_.value(); }

    /// The end of its last attempt that was in vain.
    TimePoint failed() const { return failed_; }
    /// Somebody wants a stranger that is not to be asked now.
    void on_wanted(TimePoint now) { asked_ = now; }
    /// This request is not carried out because it is offline. Who has never answered is probed with
    /// what is wanted: it may answer nothing else.
    void on_refused(const modbus::Request& request) {
        if (request.span()) last_read_ = request;
    }

    static constexpr int kFailing = 2;  ///< transactions in a row
    static constexpr int kFlaky = 4;    ///< silent ones of the last 8 attempts
    static constexpr int kOdd = 16;     ///< replies after which an exception surprises again
    static constexpr int kCredit = 2;   ///< whole timeouts that need not be paid at once
    static constexpr int kDebt = 3;     ///< ... and that are remembered
    static constexpr Duration kForgetStranger = 60s;

  private:
    Duration timeout() const {
        return settings_.adaptive_timeout ? adaptive_.value(turnaround_)
                                          : settings_.response_timeout;
    }
    /// How long its share of the bus has to save for a whole timeout.
    Duration timeout_cost() const {
        return static_cast<int>(1 / ProbeBudget::kFailing) * settings_.response_timeout;
    }
    void spend(TimePoint now, Duration cost, bool is_read = true) {
        (is_read ? budget_ : writes_).spend(now, cost, kDebt * timeout_cost());
    }
    /// A write to the same place was the last one that it did not answer.
    bool is_ignored(const modbus::Request& write) const {
        const auto place = [](const Bytes& pdu) {
            return ByteView(pdu).first(std::min<std::size_t>(pdu.size(), 3));
        };
        return std::ranges::equal(place(write.pdu()), place(ignored_));
    }
    void rest_for_owed(TimePoint now);
    void rest_is_over(TimePoint not_before);
    void learn_of_copies(TimePoint now, const Attempt& attempt);
    void learn_of_read(const modbus::Request& read, const modbus::Span& span);
    void remember_refusal(TimePoint now, ByteView pdu);
    /// It has said this unasked a moment ago.
    bool is_stray_refusal(TimePoint now, ByteView pdu) const {
        return std::ranges::equal(pdu, stray_refusal_) &&
               now < stray_refusal_at_ + CopyGuard::kLongest;
    }
    void settle_debt(TimePoint now, const Attempt& attempt);
    Duration short_wait(std::optional<Duration> line) const;

    StationSettings settings_;
    bool listed_;
    StationHealth health_;
    LateWindow late_;
    Turnaround turnaround_;
    AdaptiveTimeout adaptive_;
    DriftAlarm drift_;
    CopyGuard copies_;
    Trail trail_;
    ProbeBudget budget_{ProbeBudget::kFailing};   ///< of reads that fail; no reply pays for them
    ProbeBudget writes_{ProbeBudget::kFailing};   ///< ... of writes: reads do not pay for those
    ProbeBudget failing_{ProbeBudget::kFailing};  ///< of those while it is failing()
    std::uint8_t lately_ = 0;        ///< the last 8 attempts, the latest lowest: 1 was silent
    Debt debt_;                      ///< requests whose replies may still come
    TimePoint again_until_{};        ///< it may say the reply that came damaged once more
    Bytes damaged_pdu_;              ///< the request whose reply has just come damaged
    TimePoint not_before_{};         ///< its replies may come twice, or the line is just open
    TimePoint outstanding_until_{};  ///< what is outstanding may come; {}: nothing is
    TimePoint connected_{};          ///< the line was opened, on a way that holds things back
    Bytes stray_refusal_;            ///< that nothing asked for, and when it came first
    TimePoint stray_refusal_at_{};
    bool proof_in_vain_ = false;  ///< since it was heard last
    bool proved_ = false;  ///< nothing of what is owed can be on its way to the station any more
    Return return_;
    TimePoint asked_{};
    std::optional<modbus::Request> cheapest_read_;  ///< that it has answered
    std::optional<modbus::Request> largest_read_;   ///< the same; parts of it are answered as well
    std::optional<modbus::Request> last_read_;  ///< what to probe with before it has answered any
    std::array<std::uint32_t, modbus::kTables.size()> longest_read_{};  ///< by table
    Slowest slowest_;    ///< from request to first sign of the reply
    Quickest quickest_;  ///< the same
    TimePoint failed_{};
    Drift clock_drift_;
    int failed_in_a_row_ = 0;
    int odd_ = 0;          ///< so many more replies until answers_as_asked()
    bool missed_ = false;  ///< the attempt before was silent, and its retry has not ended
    Bytes ignored_;        ///< the write that it answered last with silence
    bool read_turn_ = false;
    bool read_missed_ = false;  ///< the last read was in vain
    bool wants_check_ = false;
    bool woken_by_write_ = false;  ///< its last probe
    bool trail_told_ = false;
    bool answers_broadcasts_ = false;  ///< it has, once
    int probes_ = 0;                   ///< in vain, since it was heard last
};

}  // namespace panelgate::arbiter
