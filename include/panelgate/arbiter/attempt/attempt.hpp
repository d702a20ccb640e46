#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/attempt/answers.hpp"
#include "panelgate/arbiter/attempt/arrivals.hpp"
#include "panelgate/arbiter/attempt/group.hpp"
#include "panelgate/arbiter/habits/echo.hpp"
#include "panelgate/arbiter/habits/input_pace.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// Outcome of an attempt.
enum class Verdict : std::uint8_t {
    open,      ///< not yet
    replied,   ///< reply() is the answer
    silent,    ///< no frame of the station until the timeout
    damaged,   ///< it began like the reply, or like our own frame, and was neither
    wrong,     ///< a good frame of the station that does not answer the request
    doubtful,  ///< the reply may duplicate an earlier one: ask once more
};

/// One request on the wire: what is heard meanwhile, its times, and finally one verdict. Damage
/// does not end it while the reply may still come (FRM-04); a silence inside a reply of known
/// length is a hole. Pure.
class Attempt {
  public:
    static constexpr int kRatesDiffer = 2;  ///< percent, between two devices on one line

    /// What the line's settings say of each attempt (see Settings).
    struct Wire {
        SerialFormat serial;
        Duration end_of_frame;
        Duration reply_hole;
        bool paced;
        bool may_stall;
    };
    struct Timing {
        TimePoint started;        ///< handed over; leaves at once or after the line's lead
        TimePoint sent;           ///< last bit out, computed
        Duration patience{};      ///< from `sent`: without a sign of a reply until then, a timeout
        Duration usual{};         ///< longest time the station has needed, at most `patience`
        Duration end_of_frame{};  ///< silence that ends a frame of unknown length
        Duration hole{};          ///< the longest silence inside a reply of known length
        Duration longest_reply{};
        Duration pause{};    ///< silence before this attempt
        Duration leaving{};  ///< time from the request's first bit to its last
        /// A reply cannot begin earlier than this before `sent`; empty: the line is no real UART.
        std::optional<Duration> tolerance;
        SerialFormat serial;
        bool steady = false;       ///< bytes arrive one by one, at the line's rate
        Duration wake_latency{};   ///< of the line
        Drift drift;               ///< of the station's clock
        bool as_asked = false;     ///< the station usually answers as asked
        bool echoes = false;       ///< the line usually echoes what is sent
        bool confirm_end = false;  ///< the driver will report when the last bit has left
        bool is_last = false;      ///< if nothing comes nobody asks again

        /// The station is known to pause for so long inside its replies.
        void allow_hole(Duration longer) {
            if (longer <= hole) return;
            longest_reply += longer - hole;
            hole = longer;
        }
    };
    /// True if this good frame of the station, which does not answer the request, was sent instead
    /// of the reply: not the echo, a duplicate, or a late reply to an earlier request.
    using Ends = std::function<bool(ByteView adu)>;

    /// Timing of a request of `size` bytes that is handed over now and starts after `lead`; the
    /// caller adds the wait times.
    static Timing timing_of(const Wire& line, TimePoint now, std::size_t size, Duration lead);

    Attempt(Group group, const Timing& timing, EchoFilter echo,
            const modbus::CrcOrders& orders = {});

    Verdict on_rx(TimePoint now, ByteView bytes, const Ends& ends);
    /// What was heard since the last end is one frame, if `good`, or none: where the line delimits
    /// frames (ASCII).
    Verdict on_frame_end(bool good, const Ends& ends);
    /// A character came that completes no byte (ASCII): what has begun goes on.
    void on_character(TimePoint now) {
        if (is_hearing()) last_byte_ = std::max(last_byte_, now);
    }
    /// What was heard since the last end breaks off.
    Verdict on_frame_cut(const Ends& ends) {
        take_from_echo(ends);
        framer_.on_cut();
        collect();
        return Verdict::open;
    }
    /// Harmless if nothing is due.
    Verdict on_deadline(TimePoint now, const Ends& ends);
    TimePoint deadline() const;
    /// A broadcast is over when its last bit has left.
    bool is_broadcast() const { return group_.station == 0; }

    /// Bytes before this time decide nothing: what may be the reply (or our echo) has begun, and
    /// the rest of its header, or of all of it, takes until then at the line's rate. An unexpected
    /// exception (Timing::as_asked) is noticed when the reply would have been complete. Empty:
    /// every byte may decide.
    std::optional<TimePoint> busy_until() const;
    /// How the bytes have come so far.
    const InputPace& pace() const { return pace_; }

    bool wants_end(TimePoint now) const { return !end_confirmed_ && now >= timing_.sent; }
    TimePoint end_wanted_at() const { return end_confirmed_ ? TimePoint::max() : timing_.sent; }
    /// `left`: the time that the wire still needs for the request. Drivers and adapters start later
    /// than asked: the computed end is the earliest. Moves all times by a second at most.
    void on_end(TimePoint now, Duration left);

    /// True if a read that arrives while the request is still leaving can share it: only a real
    /// UART takes that long. Not a retry: a reply to the first attempt may still come, and would be
    /// too old.
    bool can_join(TimePoint now, const Job& job) const;
    /// The earliest time at which its last bit may have left, by the clocks of the line's other
    /// devices.
    TimePoint earliest_end() const {
        return timing_.sent - (timing_.sent - timing_.started) * kRatesDiffer / 100;
    }

    Group& group() { return group_; }
    const Group& group() const { return group_; }
    const Timing& timing() const { return timing_; }
    TimePoint give_up() const { return timing_.sent + timing_.patience; }
    /// The whole reply PDU.
    const Bytes& reply() const { return answers_.reply(); }
    const Answers& answers() const { return answers_; }
    /// The reply may need longer than was thought when the request left.
    void allow_for(Duration longer) {
        timing_.usual = std::max(timing_.usual, longer);
        timing_.patience = std::max(timing_.patience, longer);
    }
    /// The candidate began before the request had left.
    void mark_early() { answers_.mark_early(); }
    /// True if its first byte came before the computed end of the request. Noise in front of it
    /// makes that unknown.
    bool replied_early() const { return first_byte_ < timing_.sent && noise_in_front_ == 0; }
    /// ... and earlier than a clock difference of kRatesDiffer explains.
    bool replied_too_early() const { return replied_early() && first_byte_ < earliest_end(); }
    /// When the reply came that is judged now: before, if it was a candidate.
    TimePoint came_at(TimePoint now) const {
        return answers_.in_time() && !answers_.first_came() ? answers_.in_time()->came
                                                            : std::min(now, reply_came_);
    }
    /// Time from the end of the request to the start of the reply, whose last byte came now.
    Duration waited(TimePoint now) const;
    /// ... of the candidate that its group doubts now.
    Duration waited_for_doubted() const { return waited_for(group_.doubted_at, group_.doubted); }
    /// Time from the end of the request to the first sign of a reply, as received: adapters buffer
    /// bytes.
    Duration first_sign(TimePoint now) const {
        return std::max(waited(now), first_byte_ - timing_.sent);
    }
    /// ... by which the reply has begun at the latest: pauses inside it count only behind noise.
    Duration begun_after(TimePoint now) const {
        return noise_in_front_ > 0 ? first_sign(now) : heard_after();
    }
    /// ... of whatever was heard.
    Duration heard_after() const { return first_byte_ - timing_.sent; }
    /// When the last byte came that could not yet be a reply because our frame was still leaving.
    /// Empty: none did, or the reply began then.
    std::optional<TimePoint> early_noise() const {
        return answers_.has_reply() && replied_early() ? std::nullopt : early_;
    }
    /// Rejects the reply as a duplicate of an earlier one: the station counts as heard, and the
    /// attempt goes on.
    void reject_reply();
    /// True if the rejected reply was an exception: the next one may be the same again.
    bool refusal_was_rejected() const { return refusal_rejected_; }
    /// Keeps the reply as a candidate because it may be a duplicate. Nothing else comes: until
    /// `needed` after the request, the longest time the station has needed, or, if doubted, after
    /// the candidate.
    void keep_candidate(Duration needed, Answers::Kept kind);
    /// Takes the frames that were answers, but began too early or contradict another one.
    std::vector<modbus::Unused> take_set_aside();
    /// True if the answers that came differ, and which is the reply is unknown. `is_copy`: this one
    /// has answered another request.
    bool is_undecided(bool is_copy) const { return answers_.is_undecided(is_copy, group_); }
    /// True if behind the reply another one may have begun: its rest is still to come.
    bool goes_on() const { return !own_.borrowed && framer_.has_pending(); }
    /// True if the reply came where the line's echo was expected: if the echo follows, it is
    /// another master's.
    bool precedes_echo() const {
        return timing_.echoes && !echo_.complete() && !own_.fragment && !own_.behind &&
               noise_in_front_ == 0;
    }
    /// True if the line usually echoes, and its echo came back changed: others have transmitted,
    /// and the request may never have arrived.
    bool may_have_collided() const {
        return timing_.echoes && !echo_.complete() && (echo_.mismatch() || own_.fragment);
    }
    /// True if the reply to a write may be the echo of its request, which it equals: none has come
    /// in front of it, and it came too quickly, or the line echoes, or writes come back; or they
    /// come back once more.
    bool may_be_its_echo(TimePoint now, bool too_quick, const EchoMemory& line) const {
        const bool behind_echo = echo_.complete() || own_.seen;
        return !group_.request.is_read() && echo_.is_own(reply()) &&
               (line.comes_again(now, group_.station) ||
                (!behind_echo && (too_quick || timing_.echoes || line.echoes_writes())));
    }
    /// True if this answer to a read is that read itself, where requests come back late.
    bool is_late_echo(TimePoint now, const EchoMemory& line) const {
        return group_.request.is_read() && echo_.is_own(reply()) &&
               line.comes_again(now, group_.station);
    }
    /// Rejects a reply that also answers another master's request; the station was not silent.
    void reject_contested() {
        both_came_ = both_came_ || (contested() && contested_ != reply());
        contested_ = reply();
        reject_reply();
    }
    bool contested() const { return !contested_.empty(); }
    /// True if another one came that differs: to both requests.
    bool both_came() const { return both_came_; }
    /// True if the first frame since the request began to leave asks the same station, and the
    /// reply behind it may be the answer to that.
    bool may_answer_first_heard() const;
    const Bytes& first_heard() const { return first_heard_; }
    /// True if as many damaged bytes, perhaps the same reply, came in front of it.
    bool came_damaged_before() const;
    /// Records the doubtful reply in its group.
    void remember_doubt() { answers_.remember_in(group_); }

    const EchoFilter& echo() const { return echo_; }
    /// True if the whole echo came back, and no byte of it was needed to complete the reply.
    bool echoed() const { return echo_.complete() && !own_.borrowed; }
    /// True if a candidate came before our own frame, and was dropped for that.
    bool answered_before_echo() const { return own_.before; }
    /// True if our own frame came back, wherever the filter did not take it out.
    bool heard_itself() const { return own_.came_back; }
    /// True if it did so once more, behind the echo or the reply.
    bool heard_itself_again() const { return own_.again; }
    /// Updates what is known of the line's echo from this reply.
    void teach(EchoMemory& memory) const;
    /// True if its own reply came damaged, but with the header intact, or without its beginning.
    bool came_damaged() const { return framer_.had_own_header() || beheaded_; }
    /// True if its own reply came without its first bytes.
    bool lost_beginning() const { return beheaded_; }
    /// True if what may have been its own reply broke off before its full length.
    bool was_cut_off() const { return framer_.was_damaged() && !framer_.was_damaged_whole(); }
    /// True if the station sent an exception for another function than was asked.
    bool refused_other() const { return refused_other_; }
    /// True if any frame of the station was heard, good or not.
    bool heard() const { return heard_; }
    /// True if bytes were heard that are not part of the reply.
    bool disturbed() const { return disturbed_; }
    TimePoint last_byte() const { return last_byte_; }
    /// The longest silence between two bytes of what was heard.
    Duration longest_pause() const { return longest_pause_; }
    /// When the presumed reply began: by the line's rate where the line keeps it, because bytes are
    /// read late. Requires heard() or a reply.
    TimePoint first_byte() const;
    /// Takes the bytes since the last call that came before the request had left: on a real UART
    /// they are old.
    Bytes take_stale() { return std::exchange(stale_, {}); }

    /// Takes the frames and bytes since the last call that belong to no reply.
    std::vector<modbus::Unused> take_unsolicited();
    /// All damaged bytes since the beginning (bounded).
    const Bytes& damaged_bytes() const { return damaged_bytes_; }
    /// Takes the bytes that the echo filter still buffers, and what has begun behind the reply.
    Bytes release_pending();

  private:
    /// What the station has sent instead of the reply.
    enum class Instead : std::uint8_t {
        nothing,
        unrelated,  ///< of another function: perhaps babble, and the reply has its usual time
        reply,      ///< it has said something else
    };
    Duration waited_for(TimePoint came, const Bytes& reply) const {
        const Duration frame = frame_time(timing_.serial, reply.size() + modbus::kAduOverhead);
        return std::max(came - timing_.sent - frame, Duration::zero());
    }
    void drop_what_ended(TimePoint now, std::size_t size);
    bool comes_back(ByteView bytes);
    ByteView drop_stale(TimePoint now, TimePoint before, ByteView bytes, std::size_t fresh,
                        std::size_t last);
    Verdict hear(TimePoint now, ByteView bytes, const Ends& ends);
    /// Bytes until the frame that has begun can be judged. 0: each may decide.
    std::size_t missing() const;
    std::optional<InputPace::Look> next_look() const;
    Duration byte() const { return byte_time(timing_.serial); }
    bool has_delimiters() const { return timing_.serial.mode == SerialMode::ascii; }
    /// The bytes that the echo filter buffered were no echo.
    Verdict take_from_echo(const Ends& ends);
    Verdict feed(ByteView bytes, const Ends& ends);
    Verdict accept(std::optional<Bytes> reply);
    /// Takes the parts behind this reply that answer the request and differ.
    Answers::Others take_others(const Bytes& reply, std::size_t behind);
    /// True if this is, or has begun like, another answer to the request.
    bool differs(const modbus::Unused& part, const Bytes& reply) const;
    Verdict judge_pending(const Ends& ends);
    void add_unsolicited(const Bytes& pdu) { unsolicited_.push_back(own_frame(pdu)); }
    modbus::Unused own_frame(const Bytes& pdu) const;
    /// The ADU of this reply of the station.
    Bytes adu_of(ByteView reply) const {
        return modbus::encode_adu(group_.station, reply, orders_.of(group_.station));
    }
    void judge_unsolicited(std::size_t from, const Ends& ends);
    /// Returns how many of the parts follow the reply, which has so many bytes.
    std::size_t collect(std::size_t reply = 0);
    void date(std::vector<modbus::Unused>& parts, std::size_t behind, std::size_t reply);
    void on_frame_in_front();
    void on_own_frame(bool in_front);
    bool is_hold_over() const;
    Verdict believe();
    bool is_stale(TimePoint now, std::size_t size) const;
    /// True if other bytes were heard: the reply may be lost, so wait only the usual time. If
    /// nobody asks again, only if they may have been the reply.
    bool in_doubt() const;
    /// True if the damaged bytes are the beginning of our own frame, and of no reply.
    bool is_only_own_beginning() const;
    bool is_hearing() const { return framer_.has_pending() || echo_.pending(); }

    Group group_;
    Timing timing_;
    modbus::CrcOrders orders_;
    EchoFilter echo_;
    OwnFrame own_;
    modbus::ReplyFramer framer_;
    /// As framer_, in case the echo's last byte was lost and the reply's first byte was taken for
    /// it.
    std::optional<modbus::ReplyFramer> lender_;
    Answers answers_;
    bool begins_anew_ = false;  ///< the next byte is not the candidate's
    bool beheaded_ = false;     ///< the reply lost its first bytes
    std::vector<modbus::Unused> unsolicited_;
    Bytes damaged_bytes_;
    Bytes stale_;
    Bytes first_heard_;           ///< the first bytes behind the echo, stale or not
    std::size_t heard_size_ = 0;  ///< of all of them
    Arrivals arrivals_;           ///< of what was fed to the framer
    TimePoint reply_came_{};
    InputPace pace_;
    TimePoint computed_end_;
    TimePoint first_byte_;
    std::optional<TimePoint> echo_since_;  ///< when the echo filter buffered its first byte
    TimePoint buffered_at_{};              ///< ... its last
    std::size_t buffered_last_ = 0;        ///< ... so many with that
    std::optional<TimePoint> early_;
    TimePoint last_byte_;
    Duration longest_pause_{};
    bool heard_ = false;
    bool disturbed_ = false;
    std::size_t noise_in_front_ = 0;  ///< bytes
    std::size_t came_back_ = 0;       ///< bytes, while it was leaving, which the filter let pass
    bool frames_in_front_ = false;    ///< good frames
    Bytes contested_;                 ///< the last reply that was
    bool both_came_ = false;
    bool refusal_rejected_ = false;
    Instead instead_ = Instead::nothing;
    bool refused_other_ = false;
    bool end_confirmed_ = true;
};

}  // namespace panelgate::arbiter
