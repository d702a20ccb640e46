#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/desk.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/judge.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/ascii.hpp"

namespace panelgate::arbiter {

/// The last moment at which the job's request, a gap and its normal reply still fit before its
/// deadline. Reserving only for the shortest reply, an exception, would fill an overloaded line
/// with transactions whose answers come too late.
TimePoint latest_start(const SerialFormat& serial, const Job& job);

/// Decides what one line does. Pure: time is an argument, actions are returned by poll_action();
/// calling on_deadline early or twice is harmless.
///
///     pass all bytes that the device has buffered (on_rx), so that no old byte is taken for new;
///     now = clock; arbiter.on_…(now, …);
///     while (auto action = arbiter.poll_action()) act(*action);
///     alarm at arbiter.next_deadline();
///
/// A line starts down: on_line_up comes first. Acting on an action may call the arbiter again: the
/// same loop delivers what that adds. The states and the promises (P1…P9) are those of the README.
class Arbiter : public Desk {
  public:
    explicit Arbiter(Settings settings);

    /// Switches to new settings. Outstanding replies, knowledge of stations and queued jobs are
    /// kept. Unless is_same_wire(), only while the line is down or left.
    void apply(Settings settings);
    /// The line is to be replaced: accepted jobs wait until on_line_up() or on_line_down().
    void suspend() { suspended_ = true; }
    bool is_waiting() const { return active_.has_value(); }  ///< for a request on the wire
    /// Time from which no reply is outstanding and nothing rests or is on the wire, for any master.
    /// Valid only if nothing is sent meanwhile.
    TimePoint clear_at(TimePoint now) const;
    /// Starts nothing before `until`: another master has used the wire.
    void rest_until(TimePoint until);
    /// After suspend(), not while is_waiting(): the line is closed, another one will be opened.
    void on_line_left();

    /// Accepts a job (its deadline is set here), or returns a fault at once: busy, line_down,
    /// offline. An accepted job gets exactly one Finish.
    Result<Ticket> submit(TimePoint now, Job job);
    /// Finishes matching jobs that wait for their first turn as denied, without sending them:
    /// access rights have changed since they came.
    void deny(TimePoint now, const JobQueue::Test& match);
    /// The client is gone: its queued jobs end as cancelled, and nothing is repeated for it.
    void cancel(TimePoint now, Client client);
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now) { step(now); }
    void on_line_up(TimePoint now);
    void on_line_down(TimePoint now);

    /// Sets the network round trip of every answer (RTU over TCP), from the next request on.
    void set_latency(Duration latency) { latency_ = latency; }
    /// Sets the delay from Transmit to the first bit, from the next request on.
    void set_lead(Duration lead) { lead_ = lead; }
    /// Declares that the driver can report unsent bytes: from the next request on wants_end()
    /// becomes true at the computed end of each, and on_end() must be called with the time left.
    void confirm_ends(bool confirm) { confirm_ends_ = confirm; }
    bool wants_end(TimePoint now) const { return active_ && active_->wants_end(now); }
    /// `left`: the time that the wire still needs. If positive, the end moves, and with it the
    /// timeout or the turnaround; wants_end() becomes true again then, up to a second after the
    /// computed end.
    void on_end(TimePoint now, Duration left);
    /// True if the request on the wire has timed out without a byte heard: the driver then checks
    /// that it was delivered, before on_deadline.
    bool is_unheard(TimePoint now) const {
        return active_ && !active_->is_broadcast() && !active_->heard() &&
               now >= active_->deadline();
    }

    /// When to call on_deadline next; empty if only an event can change anything.
    std::optional<TimePoint> next_deadline() const;

    /// Input before this time changes nothing: a reply has begun and the rest of it takes until
    /// then, so the driver need not read each byte. Empty: read all input at once.
    std::optional<TimePoint> busy_until() const {
        return active_ && !active_->is_broadcast() ? active_->busy_until() : std::nullopt;
    }

    /// True if no job waits and no client's request is on the wire.
    bool idle() const {
        return schedule_.backlog().empty() && (!active_ || active_->group().jobs.empty());
    }
    EchoState echo() const { return echo_memory_.state(); }
    /// Aborts if an invariant is violated. For tests.
    void check_invariants() const;

  private:
    // Requests (arbiter.cpp)
    void forget_line();
    void step(TimePoint now);
    bool start_next(TimePoint now);
    Attempt::Timing timing_of(TimePoint now, const Group& group, std::size_t size) const;
    void start(TimePoint now, Group group);
    void check_active(TimePoint now);
    void expire(TimePoint now);
    void expire_active(TimePoint now);
    void hear(TimePoint now, ByteView bytes);
    void hear_piece(TimePoint now, const modbus::AsciiTranscript::Piece& piece);
    void hear_idle(TimePoint now, ByteView bytes);
    TimePoint idle_ends() const { return quiet_.since() + settings_.end_of_frame; }
    void judge_idle(TimePoint now);

    // Frames (frames.cpp): facts, decision, deed
    void conclude(TimePoint now);
    Facts facts_of(TimePoint now, const modbus::Unused& part, bool answers) const;
    Facts facts_of_answer(TimePoint now, ByteView pdu) const;
    void judge_part(TimePoint now, const modbus::Unused& part, bool answers);
    Duration carry_out(TimePoint now, const modbus::Unused& part, Done done);
    Duration take_late(TimePoint now, const modbus::Unused& part);
    void take_wrong(ByteView adu);
    void leave_to_other_master(TimePoint now, ByteView request);

    // Ends of attempts (verdict.cpp)
    Asked asked_of(const Attempt& attempt, bool in_transit = false) const;
    void settle(TimePoint now, const Bytes& reply);
    bool close_request(TimePoint now, const Attempt& attempt, const Bytes& reply);
    void fail(TimePoint now, Verdict verdict);
    void end_broadcast(TimePoint now);
    void reopen_if_mute(TimePoint now, const Attempt& attempt, Verdict verdict);
    Attempt take_active(TimePoint now);

    modbus::CrcOrders orders_;
    std::optional<modbus::AsciiTranscript> ascii_;  ///< converts what is heard to RTU
    Quiet quiet_;
    EchoMemory echo_memory_;
    std::optional<Attempt> active_;
    Bytes idle_;                ///< heard without a request, until a silence ends it (MST-04)
    Bytes last_frame_;          ///< sent last: its echo may come when nobody waits for it
    std::uint8_t replied_ = 0;  ///< the station that answered the last frame; 0: none, or not yet
    std::uint8_t replied_before_ = 0;  ///< ... the frame before the last one
    TimePoint rest_{};                 ///< of the wire; kept when the line is opened anew
    /// T8: how long the connection has been mute.
    struct {
        int attempts = 0;         ///< silent ones in a row, without a byte from any station
        bool ever_heard = false;  ///< over this connection
        Duration pause{};         ///< between two openings for silence alone; doubles
        TimePoint next{};         ///< the next opening, at the earliest
    } mute_;
    Duration latency_{};
    Duration lead_{};
    bool confirm_ends_ = false;
};

}  // namespace panelgate::arbiter
