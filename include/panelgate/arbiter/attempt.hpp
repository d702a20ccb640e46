#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// Jobs that one transaction answers, and its request. jobs[0] leads; a probe has none.
struct Group {
    Jobs jobs{};
    std::uint8_t station = 0;
    modbus::Request request;
    std::optional<modbus::Span> span{};  ///< of a read that can be shared
    int attempts = 0;
    Transaction transaction = 0;  ///< of the last attempt
    TimePoint started{};          ///< the first attempt: what answers was not read before
    Duration silent_after{};  ///< how long the attempt before was waited for in vain; 0: it was not
    Duration
        cut_after{};  ///< the attempt before, whose reply broke off, took so long; 0: it did not
    Bytes doubted{};  ///< the attempt before was answered so, and it may be a copy; or nothing
    TimePoint doubted_at{};  ///< when that came
    bool probe = false;
    bool told_apart = false;  ///< ... of a length that nothing outstanding has (Station::proof)
    /// It is a read that tells whether the reply to the write of its jobs was that write's echo;
    /// their answer, where it was not.
    Bytes confirms{};
    bool repeatable = true;      ///< its station's `retry_writes` when it began, of a write
    bool first_silence = false;  ///< its station was well when it was first sent
    /// It only finds out about the echo, for this job, which waits in the queue.
    Ticket learns_for = 0;

    /// It asks for more than any of its jobs.
    bool joined() const {
        return !jobs.empty() &&
               std::ranges::none_of(jobs, [&](const Job& job) { return job.request == request; });
    }
    bool has(Client client, std::uint8_t to) const {
        return (station == to || station == 0) &&
               std::ranges::any_of(jobs, [&](const Job& job) { return job.client == client; });
    }
    void on_gone(Client client) {
        for (Job& job : jobs) job.gone = job.gone || job.client == client;
    }
    /// Those whose own deadline has come; the others go on waiting.
    Jobs expire(TimePoint now) {
        const auto late = [&](const Job& job) { return job.deadline <= now; };
        Jobs expired;
        std::ranges::copy_if(jobs, std::back_inserter(expired), late);
        std::erase_if(jobs, late);
        return expired;
    }
    /// What may be a copy is no answer to it before it was asked once more: values, for clients. A
    /// refusal is not asked for again; it may well be gone by then.
    bool may_doubt(ByteView reply) const {
        return is_values(reply) && doubted.empty() && !jobs.empty();
    }
    /// A refusal of it may be asked for once more.
    bool may_doubt_refusal() const {
        return request.is_read() && doubted.empty() && !jobs.empty() && confirms.empty();
    }
    /// This reply to it holds values: it is a read, and not refused.
    bool is_values(ByteView reply) const {
        return request.is_read() && reply[0] == request.function();
    }
    /// What answers a retry behind a wait may be the reply to the attempt before: it tells nothing.
    bool tells_pace() const { return silent_after + cut_after == Duration::zero(); }
    /// Nobody waits for it any more.
    bool abandoned() const { return std::ranges::all_of(jobs, &Job::gone); }
};

/// What an attempt came to.
enum class Verdict : std::uint8_t {
    open,      ///< not yet
    replied,   ///< reply() is the answer
    silent,    ///< nothing of the station until its time was over
    damaged,   ///< something that began like the reply, or like our own frame, and was neither
    wrong,     ///< a good frame of the station that does not answer the request
    doubtful,  ///< what answers it may be a copy of an earlier reply: it is to be asked once more
};

/// One request on the wire: what is heard meanwhile, its instants, and in the end one verdict.
/// Damage does not end it while the reply may still come (FRM-04); a silence inside a reply of
/// known length is a hole. Pure.
class Attempt {
  public:
    static constexpr int kRatesDiffer = 2;  ///< percent, those of two devices on one line

    struct Timing {
        TimePoint started;        ///< handed over, to leave at once or after the line's lead
        TimePoint sent;           ///< last bit out, computed
        Duration patience{};      ///< from `sent` on: no sign of a reply until then is a timeout
        Duration usual{};         ///< what the station has ever needed, at most `patience`
        Duration end_of_frame{};  ///< silence that ends what has no known length
        Duration hole{};          ///< the longest silence inside a reply of known length
        Duration longest_reply{};
        Duration pause{};    ///< the silence before this attempt
        Duration leaving{};  ///< from the first bit of the request to its last
        /// A reply cannot begin more than this before `sent`; nothing: the line is no real UART.
        std::optional<Duration> tolerance;
        SerialFormat serial;
        bool steady = false;       ///< bytes come one by one, at the line's rate
        Duration notice{};         ///< the line's Notice
        Drift drift;               ///< what looks at the station's replies have told
        bool as_asked = false;     ///< what begins is the reply that was asked for, as a rule
        bool echoes = false;       ///< what is sent on this line comes back, as a rule
        bool confirm_end = false;  ///< somebody will tell when the last bit has really left
    };
    /// Is this good frame of the station, which does not answer, what it said instead of the reply?
    /// Not when it is the echo, a copy, or the late reply to an earlier request.
    using Ends = std::function<bool(ByteView adu)>;

    /// Of a request of so many bytes that is handed over now and begins to leave after `lead`; how
    /// long it is waited for is added.
    static Timing timing_of(const Settings& line, TimePoint now, std::size_t size, Duration lead);

    Attempt(Group group, const Timing& timing, EchoFilter echo,
            const modbus::CrcOrders& orders = {});

    Verdict on_rx(TimePoint now, ByteView bytes, const Ends& ends);
    /// What came since the last end is one frame, when it is `good`, or none: where the line tells
    /// (ASCII).
    Verdict on_frame_end(bool good, const Ends& ends);
    /// Harmless when nothing is due.
    Verdict on_deadline(TimePoint now, const Ends& ends);
    TimePoint deadline() const;
    /// A broadcast is over when its last bit has left.
    bool is_broadcast() const { return group_.station == 0; }

    /// Bytes that come before then tell nothing: what may be the reply (or our echo) has begun, and
    /// the rest of its header, or of all of it, takes as long at the line's rate. Who waits needs
    /// not look at each. An exception where none was foreseen (Timing::as_asked) is noticed when
    /// the reply would have been there. Nothing: every byte may tell something.
    std::optional<TimePoint> busy_until() const;
    /// What the first look at the end of a reply that was slept through has told: how long the
    /// reply is at the line's rate, and whether it was all there.
    struct EndLook {
        Duration reply{};
        bool whole = false;
    };
    const std::optional<EndLook>& end_look() const { return end_look_; }
    /// It was an exception that nobody had foreseen.
    bool overslept() const { return overslept_; }
    /// More has come than the line's rate allows since the reply began.
    bool hasty() const { return hasty_; }

    bool wants_end(TimePoint now) const { return !end_confirmed_ && now >= timing_.sent; }
    TimePoint end_wanted_at() const { return end_confirmed_ ? TimePoint::max() : timing_.sent; }
    /// `left`: the time that the wire still needs for the request. Drivers and adapters begin to
    /// send later than asked: what is computed is the earliest end. Moves everything by a second at
    /// most.
    void on_end(TimePoint now, Duration left);

    /// A read that comes while the request is still leaving shares it: only a real UART holds it
    /// back for so long. Not a repeated one: an answer to the first attempt may still come, and
    /// would be too old.
    bool takes_along(TimePoint now, const Job& job) const;
    /// When its last bit may have left, by the clocks of the line's other devices.
    TimePoint earliest_end() const {
        return timing_.sent - (timing_.sent - timing_.started) * kRatesDiffer / 100;
    }

    Group& group() { return group_; }
    const Group& group() const { return group_; }
    const Timing& timing() const { return timing_; }
    TimePoint give_up() const { return timing_.sent + timing_.patience; }
    /// The whole answer PDU.
    const Bytes& reply() const { return *reply_; }
    /// Its first byte came before the request had left by our arithmetic. Noise in front of it
    /// tells nothing about it.
    bool replied_early() const { return first_byte_ < timing_.sent && noise_in_front_ == 0; }
    /// ... and sooner than a clock that differs by kRatesDiffer explains.
    bool replied_too_early() const { return replied_early() && first_byte_ < earliest_end(); }
    /// From the end of the request to the start of the reply, whose last byte came now.
    Duration waited(TimePoint now) const;
    /// From the end of the request to the first sign of a reply, as it reached us: adapters hold
    /// bytes back.
    Duration first_sign(TimePoint now) const {
        return std::max(waited(now), first_byte_ - timing_.sent);
    }
    /// When the last byte came that could be no reply yet: our frame was still leaving. Nothing:
    /// none did, or what began then was the reply.
    std::optional<TimePoint> early_noise() const {
        return reply_ && replied_early() ? std::nullopt : early_;
    }
    /// The reply is a copy of an earlier one: it counts as heard, and the attempt goes on.
    void reject_reply();
    /// It was a refusal: another one that follows may be the same once more.
    bool refusal_was_rejected() const { return refusal_rejected_; }
    /// It may be one: when nothing else comes until `needed` after the request, as long as the
    /// station has ever needed, it is the answer all the same; or, when it is `doubted`, as long
    /// behind it the attempt is doubtful.
    void hold_reply(Duration needed, bool doubted);
    bool was_held() const { return held_back_; }
    /// It came where the line's echo should have stood, and nothing of that before it: somebody
    /// else's, if that follows.
    bool precedes_echo() const {
        return timing_.echoes && !echo_.complete() && !fragment_ && !echo_behind_ &&
               noise_in_front_ == 0;
    }
    /// Nothing but its time tells its reply, that to a write, from the echo of its request.
    bool may_be_its_echo() const {
        return !group_.request.is_read() && !echo_.complete() && !own_frame_seen_ &&
               std::ranges::equal(adu_of(*reply_), echo_.frame());
    }
    /// Another master has asked the same station for something that this answers as well.
    bool is_contested() const { return !others_.empty() && others_.fit(adu_of(*reply_)); }
    /// Then it is nobody's, and the station was not silent.
    void reject_contested() {
        contested_ = true;
        reject_reply();
    }
    /// As much as the reply, and perhaps that very reply, came damaged in front of it.
    bool said_damaged_before() const;
    /// When what was held back came, if its reply is that once more.
    std::optional<TimePoint> said_twice() const {
        return echo_suspected_ ? std::nullopt : said_twice_;
    }
    /// What is held back may be the echo of the request, on a line that had none so far.
    void suspect_echo() { echo_suspected_ = true; }
    bool echo_is_suspected() const { return echo_suspected_; }
    /// Notes in its group what made it doubtful.
    void remember_doubt() {
        group_.doubted = std::exchange(held_, std::nullopt).value_or(Bytes{});
        group_.doubted_at = held_at_;
    }

    const EchoFilter& echo() const { return echo_; }
    /// The whole echo came back, and nothing of it was needed to make the reply whole.
    bool echoed() const { return echo_.complete() && !borrowed_; }
    /// What its reply tells about the line's echo.
    void teach(EchoMemory& memory) const;
    /// Its own reply has come, but damaged: what tells it from anything else is whole.
    bool came_damaged() const { return framer_.had_own_header(); }
    /// What may have been its own reply began, and never became as long as that would be.
    bool was_cut_off() const { return framer_.was_damaged() && !framer_.was_damaged_whole(); }
    /// The station refused with the number of a function that it was not asked.
    bool refused_other() const { return refused_other_; }
    /// Something of the station was heard, good or not.
    bool heard() const { return heard_; }
    /// Bytes were heard that came before a reply could.
    bool disturbed() const { return disturbed_; }
    TimePoint last_byte() const { return last_byte_; }
    /// When what was taken for a reply began: by the line's rate where it keeps that, because bytes
    /// are looked at late. heard() or replied.
    TimePoint first_byte() const;
    /// Bytes that came before the request had left: on a real UART they are old. Since the last
    /// call.
    Bytes take_stale() { return std::exchange(stale_, {}); }

    /// What was heard and belongs to no reply, since the last call.
    std::vector<modbus::Unused> take_strays();
    /// All of it that was damaged, since the beginning (bounded).
    const Bytes& damaged_bytes() const { return damaged_bytes_; }
    /// What the echo filter still holds back.
    Bytes release_echo() { return echo_.release(); }

  private:
    void drop_what_ended(TimePoint now, std::size_t size);
    Verdict hear(TimePoint now, ByteView bytes, const Ends& ends);
    /// Bytes, until what has begun tells more. 0: each may tell.
    std::size_t missing() const;
    struct NextLook {
        TimePoint at;
        Duration reply{};  ///< at the line's rate, from its beginning until then
        bool end = false;  ///< at all of it
    };
    std::optional<NextLook> next_look() const;
    Duration byte() const { return byte_time(timing_.serial); }
    bool ends_are_told() const { return timing_.serial.mode == SerialMode::ascii; }
    /// What the echo filter has held back was no echo.
    Verdict take_held(const Ends& ends);
    Verdict feed(ByteView bytes, const Ends& ends);
    Verdict accept(std::optional<Bytes> reply);
    bool may_be_echo(ByteView reply) const;
    Verdict judge_pending(const Ends& ends);
    void stray_frame(const Bytes& pdu);
    /// What the station has said when this is its reply.
    Bytes adu_of(ByteView reply) const {
        return modbus::encode_adu(group_.station, reply, orders_.of(group_.station));
    }
    void judge_strays(std::size_t from, const Ends& ends);
    void collect();
    void on_echo_behind();
    bool is_stale(TimePoint now, std::size_t size) const;
    /// Bytes of somebody were heard: the reply may be lost, and the usual time tells.
    bool in_doubt() const { return framer_.was_damaged() || echo_.mismatch() || disturbed_; }
    bool is_hearing() const { return framer_.has_pending() || echo_.pending(); }

    Group group_;
    Timing timing_;
    modbus::CrcOrders orders_;
    EchoFilter echo_;
    modbus::ReplyFramer framer_;
    /// As framer_, for the case that the echo's last byte was lost and the reply's first was taken
    /// for it.
    std::optional<modbus::ReplyFramer> lender_;
    std::optional<Bytes> reply_;
    std::optional<Bytes> held_;  ///< a reply that may be a copy
    bool held_back_ = false;
    TimePoint held_at_{};
    std::optional<TimePoint> said_twice_;
    bool doubted_ = false;  ///< what is held
    std::vector<modbus::Unused> strays_;
    Bytes damaged_bytes_;
    Bytes stale_;
    TimePoint computed_end_;
    TimePoint first_byte_;
    std::optional<TimePoint> held_since_;  ///< the first byte that the echo filter held back
    std::optional<TimePoint> early_;
    TimePoint last_byte_;
    /// What is heard, if the line has kept its rate since; nothing: the next byte tells.
    std::optional<TimePoint> began_;
    std::size_t since_ = 0;  ///< bytes since then
    TimePoint looked_{};     ///< when bytes came last
    std::optional<EndLook> end_look_;
    bool overslept_ = false;  ///< its reply is shorter than foreseen: an exception
    bool hasty_ = false;
    bool heard_ = false;
    bool disturbed_ = false;
    bool fragment_ = false;
    bool echo_behind_ = false;     ///< behind a frame of somebody
    Questions others_;             ///< of other masters
    bool own_frame_seen_ = false;  ///< behind something else, where only its echo was expected
    bool echo_possible_ = true;
    std::size_t noise_in_front_ = 0;  ///< bytes
    bool frames_in_front_ = false;    ///< good ones
    bool contested_ = false;
    bool refusal_rejected_ = false;
    bool echo_suspected_ = false;
    bool borrowed_ = false;
    bool wrong_ = false;
    bool refused_other_ = false;
    bool strange_ = false;  ///< the station said something that has nothing to do with the request
    bool end_confirmed_ = true;
};

}  // namespace panelgate::arbiter
