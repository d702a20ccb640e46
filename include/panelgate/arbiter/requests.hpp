#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// What a good frame of a station may be that answers no open request.
enum class Claim : std::uint8_t {
    late,       ///< an outstanding reply
    duplicate,  ///< a duplicate of a recent reply
    second,     ///< another frame of the last reply's form: two panels with one address
    unasked,    ///< anything else
};

/// The book of one station (P1): its requests that may still be answered, those answered lately,
/// and the reads that it is known to answer. Acceptance (whose is this reply?) and admission (could
/// another reply be taken for this request's?) are one question asked twice, and have their one
/// answer here. tests/model has the same rules apart from the code. Pure.
class OutstandingRequests {
  public:
    explicit OutstandingRequests(const StationSettings& settings);
    /// Keeps what is outstanding; a rest that has begun is not shortened.
    void apply(const StationSettings& settings);

    // Admission

    bool any() const { return !replies_.empty(); }
    /// True if a reply is outstanding to a request that left at `since` or later.
    bool any_since(TimePoint since) const { return any() && replies_.last_sent() >= since; }
    /// True if an outstanding normal reply could be taken for the reply to this request. An
    /// exception may answer any request of the same function (refuses_other()). `again`: it is a
    /// retry, which its own earlier attempts may answer.
    bool is_ambiguous(const modbus::Request& request, bool again = false) const {
        return replies_.is_ambiguous(request, again);
    }
    /// Time from which this request may be sent. One with another function, length or address is
    /// unambiguous and need not wait.
    TimePoint clear_at(const modbus::Request& request, bool again = false) const {
        if (again && (request.pdu() == damaged_pdu_ || replies_.is_only(request.pdu())))
            return drained_at_;
        return std::max(drained_at_, is_ambiguous(request, again) ? rested() : not_before_);
    }
    /// Time from which any request may be sent.
    TimePoint rested() const { return std::max({not_before_, until_, drained_at_}); }
    /// True if only this request is outstanding, or none.
    bool is_only(const modbus::Request& request) const { return replies_.is_only(request.pdu()); }
    /// How long after a request has left its reply may still come.
    Duration latest_reply() const { return timeout_ + late_.value(); }
    Duration worst_lateness() const { return late_.worst(); }
    /// How long after a broadcast the station may answer it, which is wrong: its longest usual
    /// time; if it has done so, the window of any reply, or somewhat longer than that took.
    Duration broadcast_window(Duration usual) const {
        return broadcast_delay_
                   ? std::max(latest_reply(), *broadcast_delay_ * 5 / 4 + timing::kBroadcastMargin)
                   : usual + late_.worst();
    }
    /// True if it has answered one with an exception.
    bool refuses_broadcasts() const { return refuses_broadcasts_; }
    /// True if it has answered every request since the line was reopened: then no reply is in
    /// transit, even if outstanding ones look the same.
    bool answered_since_reopen() const { return reconnect_.answered(); }

    // Reads that tell

    /// A read that it is known to answer, the cheapest; else what was asked last.
    modbus::Request probe() const;
    /// The probe, or a read of another length, which no outstanding reply fits except an exception:
    /// a station serves in order, so its answer shows that no earlier reply can still come.
    /// Alternates while unanswered.
    modbus::Request proof() const;
    /// True if sending proof() is quicker than waiting. False after an unanswered proof, until the
    /// station has answered something.
    bool may_prove() const {
        return any() && !disordered_at_ && replies_.first_sent() >= connected_ &&
               has_answered_reads() && !proof_unanswered_ && !is_ambiguous(proof());
    }
    bool has_answered_reads() const { return cheapest_read_.has_value(); }
    /// Longest read of this table that it has answered, in items.
    std::uint32_t longest_read(modbus::Table table) const {
        return longest_read_[static_cast<std::size_t>(table)];
    }

    // Acceptance

    /// What an unsolicited good frame is. `pdu`: without address and CRC.
    Claim claim_of(TimePoint now, ByteView pdu) const;
    /// True if this exception may answer another outstanding request.
    bool refuses_other(ByteView reply, const Bytes& pdu) const {
        return replies_.fits_other(reply, pdu);
    }
    /// ... by a panel that uses another function's number, or that repeats a recent unsolicited
    /// exception: asking again decides.
    bool may_refuse_other(TimePoint now, ByteView reply, std::uint8_t function) const {
        return is_unsolicited_refusal(now, reply) ||
               (now < until_ && replies_.has_other_function(function));
    }
    /// True if the answer repeats a recent reply and came `too_early`: the request may never have
    /// arrived.
    bool is_duplicate(TimePoint now, const Attempt& attempt, bool too_early) const {
        const bool again = attempt.group().attempts > 1;
        return too_early && !again && duplicates_.is_duplicate(now, attempt.reply());
    }
    /// True if it may be a duplicate: it repeats a reply, and duplicates come from this station, or
    /// it has not yet shown that it gives equal answers to different requests, or it came `early`
    /// or `quicker` than ever. A doubted reply that comes again is no duplicate.
    bool may_be_duplicate(TimePoint now, const Attempt& attempt, bool early, bool quicker) const;
    /// True if this reply may be that to an earlier request, which was closed because a later one
    /// has been answered, and which can still come. An earlier attempt of the same read may
    /// answer it.
    bool may_answer_closed(TimePoint now, ByteView reply, const modbus::Request& request) const {
        const ByteView same = request.is_read() ? ByteView(request.pdu()) : ByteView();
        return replies_.fits_closed_by_order(reply, now - latest_reply(), same);
    }
    /// Time of the latest request that this reply proves to have reached the station: an attempt
    /// started at `started`, or the first outstanding one that the reply fits.
    TimePoint surely_answered(TimePoint started, ByteView reply) const;
    /// The pause that a station known to send duplicates needs after a reply, at most `longest`;
    /// empty: none.
    TimePoint duplicates_until(Duration longest) const {
        const bool known = duplicates_.known() && duplicates_.settle_time() <= longest;
        return known ? duplicates_.rest_until() : TimePoint{};
    }

    // Events

    /// A request is sent. Clears what cannot come any more, unless `in_transit`: then it may still
    /// come at any time.
    void on_asked(TimePoint now, const Group& group, bool in_transit);
    /// What clients want of a station that has never answered: it may answer nothing else.
    void on_wanted(const modbus::Request& request) {
        if (request.span()) last_read_ = request;
    }
    /// An attempt that left at `sent` ended without its own reply: one more is outstanding, until
    /// it has come or cannot come any more.
    void on_unanswered(TimePoint now, const Bytes& pdu, TimePoint sent);
    /// ... but for a reply that may be a duplicate of an earlier one; a duplicate of this
    /// one may follow.
    void on_doubted(TimePoint now, const Group& group, TimePoint sent) {
        if (group.request.is_read())
            duplicates_.on_reply(group.doubted_at, group.request.pdu(), group.doubted);
        on_unanswered(now, group.request.pdu(), sent);
    }
    /// ... but its reply came damaged. Some panels resend it: until that would be over only the
    /// same request may be sent, and after its answer the same rest applies.
    void on_damaged_reply(TimePoint now, const modbus::Request& request, TimePoint sent);
    /// A read that no client asked for was unanswered; `distinct_length`: a proof() whose failure
    /// says nothing about health.
    void on_probe_unanswered(bool distinct_length) {
        reconnect_.on_probe_unanswered(distinct_length);
        proof_unanswered_ = proof_unanswered_ || distinct_length;
    }
    /// An attempt was answered; `waited`: from the end of the request to the first sign of it.
    void on_answered(TimePoint now, const Attempt& attempt, Duration waited);

    struct Heard {
        Claim claim = Claim::unasked;
        Duration lateness{};             ///< of a late reply, after its response timeout
        std::optional<Duration> needed;  ///< of one that came within it, after a shortened wait
        bool settled = false;            ///< no reply is outstanding any more
    };
    /// A good frame came that is no answer. `asked`: a request to it is on the wire, which this
    /// does not answer.
    Heard on_unsolicited(TimePoint now, ByteView pdu, bool asked);
    /// Damaged bytes were heard; `id`: the station's own address.
    void on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes);
    /// It has answered a broadcast, which is wrong, so long after it.
    void on_broadcast_answered(Duration delay, bool refused) {
        refuses_broadcasts_ = refuses_broadcasts_ || refused;
        broadcast_delay_ = std::max(broadcast_delay_.value_or(delay), delay);
    }
    /// The line was reopened, on a transport that may stall. Outstanding requests may be sent, and
    /// answered, only now: the station rests for that. `usual`: its longest usual time.
    void on_opened(TimePoint now, Duration usual);
    /// The transport was proved free now by a request that left at `sent`: earlier outstanding
    /// requests may only now have reached the station.
    void on_proved(TimePoint now, TimePoint sent);

    static constexpr int kClosedMemory = 8;  ///< response timeouts

  private:
    /// It has sent this exception unsolicited just before.
    bool is_unsolicited_refusal(TimePoint now, ByteView pdu) const {
        return std::ranges::equal(pdu, unsolicited_refusal_) &&
               now < unsolicited_refusal_at_ + timing::kLatestRepetition;
    }
    void remember_refusal(TimePoint now, ByteView pdu);
    void rest(TimePoint now);
    void rest_is_over(TimePoint not_before);
    Heard on_disorder(TimePoint now, ByteView pdu);
    void close(ByteView reply, bool asked);
    void learn_of_duplicates(TimePoint now, const Attempt& attempt);
    void learn_of_read(const modbus::Request& read, const modbus::Span& span);
    void settle(TimePoint now, const Attempt& attempt);

    Duration timeout_;  ///< response_timeout
    modbus::CrcOrder crc_order_;
    LateWindow late_;
    OutstandingReplies replies_;
    DuplicateGuard duplicates_;
    ReconnectState reconnect_;
    TimePoint not_before_{};   ///< duplicates may come, or the line was just opened
    TimePoint until_{};        ///< outstanding replies may come; {}: none are
    TimePoint connected_{};    ///< when the line was opened, on a transport that may stall
    TimePoint again_until_{};  ///< it may resend the damaged reply until then
    Bytes damaged_pdu_;        ///< the request whose reply has just come damaged
    /// When it last answered a request after a later one: order closes nothing, and proves nothing,
    /// for timing::kForgetHabit after that.
    std::optional<TimePoint> disordered_at_;
    TimePoint drained_at_{};  ///< nothing is sent before, behind a disorder: answers are one behind
    Bytes unsolicited_refusal_;  ///< and when it first came
    TimePoint unsolicited_refusal_at_{};
    bool proof_unanswered_ = false;  ///< since it was last heard
    bool proved_ = false;            ///< no outstanding request is in transit
    bool refuses_broadcasts_ = false;
    std::optional<Duration> broadcast_delay_;       ///< the longest, of its answers to broadcasts
    std::optional<modbus::Request> cheapest_read_;  ///< that it has answered
    std::optional<modbus::Request> largest_read_;   ///< that it has answered; so are parts of it
    std::optional<modbus::Request> last_read_;      ///< probe before it has answered any
    std::array<std::uint32_t, modbus::kTables.size()> longest_read_{};  ///< by table
};

}  // namespace panelgate::arbiter
