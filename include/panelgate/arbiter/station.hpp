#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// Classification of an unsolicited good frame of a station.
enum class Unsolicited : std::uint8_t {
    late,       ///< an outstanding reply
    duplicate,  ///< a duplicate of a recent reply
    second,     ///< another frame of the last reply's shape: two panels with one address
    unasked,    ///< anything else
};

/// State of one station: its outstanding replies, when it may be asked, how long to wait for it,
/// and how to classify its unsolicited frames. Pure.
class Station {
  public:
    /// `frame`: duration of a usual reply on this line.
    Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
            Duration frame = {});

    /// Applies new settings. Outstanding replies and what is known of the station are kept; a rest
    /// that has begun is not shortened.
    void apply(const StationSettings& settings, const OfflineSettings& offline, bool listed);

    // Outstanding replies (P1)

    /// An attempt that left at `sent` ended without its own reply: one more is outstanding, until
    /// it has come or cannot come any more.
    void add_outstanding(TimePoint now, const Bytes& pdu, TimePoint sent);
    /// ... but its reply came damaged. Some panels resend it: until that would be over only the
    /// same request may be sent, and after its answer the same rest applies.
    void on_damaged_reply(TimePoint now, const modbus::Request& request, TimePoint sent);
    bool has_outstanding() const { return !outstanding_.empty(); }
    /// Time from which any request may be sent.
    TimePoint rested() const { return std::max(not_before_, outstanding_until_); }
    /// Time from which this request may be sent: no outstanding reply could be taken for its
    /// answer. A request with another function, length or address is unambiguous and need not wait.
    /// `again`: it is a retry.
    TimePoint clear_at(const modbus::Request& request, bool again = false) const {
        if (again && (request.pdu() == damaged_pdu_ || outstanding_.is_only(request.pdu())))
            return {};
        return is_ambiguous(request, again) ? rested() : not_before_;
    }
    /// True if an outstanding normal reply could be taken for the reply to this request. An
    /// exception may answer any request of the same function (refuses_other()).
    bool is_ambiguous(const modbus::Request& request, bool again = false) const {
        return outstanding_.is_ambiguous(request, again);
    }
    /// True if its last request was an unanswered write: a waiting read goes next.
    bool has_read_turn() const { return read_turn_; }
    /// True if it has answered reads and the last one too: failed writes do not postpone reads.
    bool answers_reads() const { return cheapest_read_ && !read_missed_; }
    /// True if so many writes in a row failed that a read must check whether it is there.
    bool wants_check() const { return wants_check_; }
    /// True if sending proof() is quicker than waiting: the station serves in order, so its answer
    /// shows that no earlier reply can still come. False after an unanswered proof, until the
    /// station has answered something.
    bool may_prove() const {
        return has_outstanding() && outstanding_.first_sent() >= connected_ && cheapest_read_ &&
               !proof_unanswered_ && !health_.offline() && !is_ambiguous(proof());
    }
    /// True if it has answered its last request.
    bool is_answering() const { return !missed_ && health_.silent_in_a_row() == 0; }
    /// How long after a request has left its reply may still come.
    Duration latest_reply() const { return settings_.response_timeout + late_.value(); }
    /// When its next probe may be sent: usually the probe is the outstanding request itself.
    TimePoint probe_due() const {
        if (wants_check_) return clear_at(probe());
        return std::max(health_.next_probe(),
                        outstanding_.is_only(probe().pdu()) ? TimePoint{} : rested());
    }
    /// A request is sent. Clears outstanding replies whose time has passed, unless `in_transit`:
    /// they may still come at any time.
    void on_asked(TimePoint now, const Group& group, bool in_transit = false);
    /// True if a reply is outstanding to a request that left at `since` or later.
    bool has_outstanding_since(TimePoint since) const {
        return has_outstanding() && outstanding_.last_sent() >= since;
    }
    /// True if this exception may answer another outstanding request.
    bool refuses_other(ByteView reply, const Bytes& pdu) const {
        return outstanding_.fits_other(reply, pdu);
    }
    /// ... by a panel that uses another function's number, or that repeats a recent unsolicited
    /// exception: asking again decides.
    bool may_refuse_other(TimePoint now, ByteView reply, std::uint8_t function) const {
        return is_unsolicited_refusal(now, reply) ||
               (now < outstanding_until_ && outstanding_.has_other_function(function));
    }
    /// True if it has answered every request since the line was reopened: then no reply is in
    /// transit, even if outstanding ones look the same.
    bool answered_since_reopen() const { return reconnect_.answered(); }
    /// Time of the latest request that this reply proves to have reached the station: an attempt
    /// started at `started`, or the first outstanding one that the reply fits.
    TimePoint surely_answered(TimePoint started, ByteView reply) const;
    void on_line_down() { health_.on_line_down(); }
    /// The line was reopened. Outstanding requests may be sent, and answered, only now: the station
    /// rests for that.
    void on_opened(TimePoint now);
    /// The transport was proved free now by a request that left at `sent`: earlier outstanding
    /// requests may only now have reached the station.
    void on_proved(TimePoint now, TimePoint sent);

    // Replies and failures

    struct Heard {
        Unsolicited kind = Unsolicited::unasked;
        Duration lateness{};   ///< of a late reply, after its response timeout
        bool back = false;     ///< it was offline
        bool settled = false;  ///< no reply is outstanding any more
    };
    /// It has answered a broadcast, which is wrong.
    void on_broadcast_answered() { answers_broadcasts_ = true; }
    /// How long after a broadcast it may answer it: its longest usual time; for a station that has
    /// done so, the same window as for any reply.
    Duration broadcast_window() const {
        return answers_broadcasts_ ? settings_.response_timeout + late_.value()
                                   : usual() + late_.worst();
    }
    /// Classifies an unsolicited frame and updates the state. `pdu`: without address and CRC.
    /// `asked`: a request to it is on the wire, which this does not answer.
    Heard on_unsolicited_frame(TimePoint now, ByteView pdu, bool asked = false);
    /// Classifies as on_unsolicited_frame(), without changes.
    Unsolicited judge(TimePoint now, ByteView pdu) const;
    /// Unsolicited bytes followed its reply.
    void on_unsolicited_bytes(TimePoint now) { trail_.on_unsolicited(now); }

    /// Damaged bytes were heard; `id`: the station's own address.
    void on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes);

    struct Replied {
        bool back = false;              ///< it was offline
        bool trailed = false;           ///< something followed the previous reply
        std::optional<Duration> drift;  ///< new: its replies come this near the response timeout
        std::optional<Duration> trail;  ///< new: this long something follows its replies
    };
    /// An attempt was answered. `waited`: from the end of the request to the first sign of the
    /// reply; `think`: without the silence by which the panel detects the end of the request.
    Replied on_reply(TimePoint now, const Attempt& attempt, Duration waited, Duration think);
    /// An attempt that occupied the line for `cost` failed.
    void on_failed(TimePoint now, Verdict verdict, Duration cost,
                   const modbus::Request* write = nullptr);
    /// A read that no client asked for was unanswered; `distinct_length`: a proof() whose failure
    /// says nothing about health.
    void on_probe_unanswered(bool distinct_length) {
        reconnect_.on_probe_unanswered(distinct_length);
        proof_unanswered_ = proof_unanswered_ || distinct_length;
    }
    /// The whole transaction failed. Returns true if that took the station offline.
    bool on_given_up(TimePoint now, Fault fault, bool is_read = true);
    /// True if the answer repeats a recent reply and came `too_early`: the request may never have
    /// arrived.
    bool is_duplicate(TimePoint now, const Attempt& attempt, bool too_early) const {
        const bool again = attempt.group().attempts > 1;
        return too_early && !again && duplicates_.is_duplicate(now, attempt.reply());
    }
    /// True if it may be a duplicate: it repeats a reply, and duplicates come from this station, or
    /// it has not yet shown that it gives equal answers to different requests, or it came `early`.
    /// A doubted reply that comes again is no duplicate.
    bool may_be_duplicate(TimePoint now, const Attempt& attempt, bool early) const {
        const Group& group = attempt.group();
        if (attempt.had_candidate() || attempt.reply() == group.doubted) return false;
        const Bytes& pdu = group.request.pdu();
        return is_duplicate(now, attempt, early) ||
               duplicates_.repeats_itself(now, attempt.reply()) ||
               duplicates_.suspicious(now, pdu, attempt.reply()) ||
               (is_quicker_than_ever(attempt.first_sign(now)) &&
                duplicates_.repeats_other(now, pdu, attempt.reply()));
    }
    /// True if no recent reply began this soon after the request.
    bool is_quicker_than_ever(Duration first_sign) const {
        const auto quickest = quickest_.value();
        return quickest && first_sign < *quickest;
    }
    /// ... by a wide margin; compared with the whole `line` if few replies of the station are
    /// known.
    bool is_far_too_quick(Duration first_sign, const Quickest& line) const {
        const Quickest& seen = quickest_.known() ? quickest_ : line;
        return seen.known() && first_sign < *seen.value() * 3 / 4;
    }

    // How to ask it

    const StationSettings& settings() const { return settings_; }
    const StationHealth& health() const { return health_; }
    /// Returns true if this client's request may be the probe, once per interval. A write that was
    /// ignored does not prevent a read from being the next one.
    bool take_half_open(TimePoint now, bool is_read);
    /// True if it is neither listed nor was ever heard.
    bool unheard() const { return !listed_ && !health_.last_heard(); }
    bool forgettable(TimePoint now) const {
        return unheard() && !has_outstanding() && now >= asked_ + kForgetUnheard;
    }
    /// True if it missed its last request, and is not offline yet.
    bool missed_last() const {
        return (missed_ || health_.silent_in_a_row() > 0) && !health_.offline();
    }
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
        const bool was_ignored = write != nullptr && is_ignored(*write);
        return now >= affordable_at() &&
               (!was_ignored || writes_.allows(now, kCredit * timeout_cost()));
    }
    /// ... true while its share is exceeded, credit aside.
    bool over_budget(TimePoint now) const { return !budget_.allows(now); }
    /// The whole line rests for `rest` because of it.
    void on_line_rests(TimePoint now, Duration rest) {
        spend(now, rest);
        if (failing()) failing_.add(rest);
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
    Duration usual(std::optional<Duration> line = {}) const { return short_wait(line); }
    /// ... without that margin, except for receiver buffering.
    Duration needed() const { return slowest().value_or(settings_.response_timeout) + 10ms; }
    Duration response_timeout() const { return timeout(); }
    /// True if its last replies were as requested: no exceptions, no damage.
    bool answers_as_asked() const { return unusual_ == 0; }
    const Drift& clock_drift() const { return clock_drift_; }
    modbus::Request probe() const;
    /// The probe, or a read of another length, which no outstanding reply fits except an exception.
    /// Alternates while unanswered.
    modbus::Request proof() const;
    /// Longest read of this table that it has answered, in items.
    std::uint32_t longest_read(modbus::Table table) const {
        return longest_read_[static_cast<std::size_t>(table)];
    }
    Duration worst_lateness() const { return late_.worst(); }
    /// Time until which the line should rest because of what follows its replies.
    TimePoint trail_until() const {
        const bool duplicates =
            duplicates_.known() && duplicates_.settle_time() <= trail_.longest();
        return std::max(trail_.until(), duplicates ? duplicates_.rest_until() : TimePoint{});
    }
    std::optional<Duration> slowest() const { return slowest_.value(); }
    /// Enough replies have shown how long it may need.
    bool is_slowest_known() const { return slowest_.is_significant(); }

    /// End of its last failed attempt.
    TimePoint failed() const { return failed_; }
    /// A client wants this unheard station, which is not asked now.
    void on_wanted(TimePoint now) { asked_ = now; }
    /// The request is refused because the station is offline. If it has never answered, it is
    /// probed with what clients want: it may answer nothing else.
    void on_refused(const modbus::Request& request) {
        if (request.span()) last_read_ = request;
    }

    static constexpr int kFailing = 2;          ///< failed transactions in a row
    static constexpr int kFlaky = 4;            ///< silent ones of the last 8 attempts
    static constexpr int kUnusualReplies = 16;  ///< replies until an exception is unexpected again
    static constexpr int kCredit = 2;           ///< whole timeouts of credit
    static constexpr int kBudgetMemory = 3;     ///< whole timeouts that are remembered
    static constexpr Duration kForgetUnheard = 60s;

  private:
    Duration timeout() const {
        return settings_.adaptive_timeout ? adaptive_.value(turnaround_)
                                          : settings_.response_timeout;
    }
    /// Time in which its share of the line covers one whole timeout.
    Duration timeout_cost() const {
        return static_cast<int>(1 / ProbeBudget::kFailing) * settings_.response_timeout;
    }
    void spend(TimePoint now, Duration cost, bool is_read = true) {
        (is_read ? budget_ : writes_).spend(now, cost, kBudgetMemory * timeout_cost());
    }
    bool answers_either(ByteView pdu, bool asked) const;
    /// True if its last unanswered write was to the same address.
    bool is_ignored(const modbus::Request& write) const {
        const auto place = [](const Bytes& pdu) {
            return ByteView(pdu).first(std::min<std::size_t>(pdu.size(), 3));
        };
        return std::ranges::equal(place(write.pdu()), place(ignored_));
    }
    void rest_for_outstanding(TimePoint now);
    void rest_is_over(TimePoint not_before);
    void learn_of_duplicates(TimePoint now, const Attempt& attempt);
    void learn_of_read(const modbus::Request& read, const modbus::Span& span);
    void remember_refusal(TimePoint now, ByteView pdu);
    /// True if it has sent this exception unsolicited just before.
    bool is_unsolicited_refusal(TimePoint now, ByteView pdu) const {
        return std::ranges::equal(pdu, unsolicited_refusal_) &&
               now < unsolicited_refusal_at_ + DuplicateGuard::kLongest;
    }
    void settle_outstanding(TimePoint now, const Attempt& attempt);
    Duration short_wait(std::optional<Duration> line) const;

    StationSettings settings_;
    bool listed_;
    StationHealth health_;
    LateWindow late_;
    Turnaround turnaround_;
    AdaptiveTimeout adaptive_;
    DriftAlarm drift_;
    DuplicateGuard duplicates_;
    Trail trail_;
    ProbeBudget budget_{ProbeBudget::kFailing};   ///< of reads that fail; replies do not reduce it
    ProbeBudget writes_{ProbeBudget::kFailing};   ///< of writes that fail, separate from reads
    ProbeBudget failing_{ProbeBudget::kFailing};  ///< of failures while it is failing()
    std::uint8_t lately_ = 0;         ///< the last 8 attempts, latest lowest: 1 was silent
    OutstandingReplies outstanding_;  ///< requests whose replies may still come
    TimePoint again_until_{};         ///< it may resend the damaged reply until then
    Bytes damaged_pdu_;               ///< the request whose reply has just come damaged
    TimePoint not_before_{};          ///< duplicates may come, or the line was just opened
    TimePoint outstanding_until_{};   ///< outstanding replies may come; {}: none are
    TimePoint connected_{};           ///< when the line was opened, on a transport that may stall
    Bytes unsolicited_refusal_;       ///< and when it first came
    TimePoint unsolicited_refusal_at_{};
    bool proof_unanswered_ = false;  ///< since it was last heard
    bool proved_ = false;            ///< no outstanding request is in transit
    ReconnectState reconnect_;
    TimePoint asked_{};
    std::optional<modbus::Request> cheapest_read_;  ///< that it has answered
    std::optional<modbus::Request> largest_read_;   ///< that it has answered; so are parts of it
    std::optional<modbus::Request> last_read_;      ///< probe before it has answered any
    std::array<std::uint32_t, modbus::kTables.size()> longest_read_{};  ///< by table
    Slowest slowest_;    ///< from request to first sign of the reply
    Quickest quickest_;  ///< the same
    TimePoint failed_{};
    Drift clock_drift_;
    int failed_in_a_row_ = 0;
    int unusual_ = 0;      ///< replies left until answers_as_asked()
    bool missed_ = false;  ///< the last attempt was silent, and its retry has not ended
    Bytes ignored_;        ///< the last write that it did not answer
    bool read_turn_ = false;
    bool read_missed_ = false;  ///< the last read was unanswered
    bool wants_check_ = false;
    bool woken_by_write_ = false;  ///< its last probe was a client's write
    bool trail_reported_ = false;
    bool answers_broadcasts_ = false;  ///< at least once
    int probes_ = 0;                   ///< unanswered, since it was last heard
};

}  // namespace panelgate::arbiter
