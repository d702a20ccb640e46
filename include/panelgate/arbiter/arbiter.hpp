#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt/attempt.hpp"
#include "panelgate/arbiter/book/judge.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/habits/echo.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/outbox.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/schedule.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/arbiter/unsolicited.hpp"
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
class Arbiter {
  public:
    explicit Arbiter(Settings settings);

    /// Switches to new settings. Outstanding replies, knowledge of stations and queued jobs are
    /// kept. Unless is_same_wire(), only while the line is down or left.
    void apply(Settings settings);
    /// The line is to be replaced by another one: starts nothing until on_line_up or on_line_down.
    /// Accepted jobs wait.
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
    /// The client is gone: its queued jobs are finished as cancelled, without being sent; a request
    /// on the wire is not repeated for it.
    void cancel(TimePoint now, Client client);
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now) { step(now); }
    void on_line_up(TimePoint now);
    void on_line_down(TimePoint now);

    /// Sets the network round trip that is added to every answer (RTU over TCP), from the next
    /// request on.
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

    std::optional<Action> poll_action() { return outbox_.poll(); }
    /// When to call on_deadline next; empty if only an event can change anything.
    std::optional<TimePoint> next_deadline() const;

    /// Input before this time changes nothing: a reply has begun and the rest of it takes until
    /// then, so the driver need not read each byte. Empty: read all input at once.
    std::optional<TimePoint> busy_until() const {
        return active_ && !active_->is_broadcast() ? active_->busy_until() : std::nullopt;
    }

    std::size_t queue_depth() const { return schedule_.backlog().queue().size(); }
    /// True if no job waits and no client's request is on the wire.
    bool idle() const {
        return schedule_.backlog().empty() && (!active_ || active_->group().jobs.empty());
    }
    const LineCounters& counters() const { return outbox_.line(); }
    /// By station; unlisted stations share entry 0.
    const std::map<std::uint8_t, StationCounters>& station_counters() const {
        return outbox_.stations();
    }
    /// Unknown if the station was never asked.
    StationHealth health(std::uint8_t id) const { return stations_.health(id); }
    Condition condition(std::uint8_t id) const { return stations_.condition(id); }
    /// Time that the next request to this station waits for its reply to begin.
    Duration response_timeout(std::uint8_t id) const { return stations_.response_timeout(id); }
    const BusShares& shares() const { return outbox_.shares(); }
    EchoState echo() const { return echo_memory_.state(); }
    /// Aborts if an invariant is violated. For tests.
    void check_invariants() const;

  private:
    std::optional<ReadCache::Hit> from_memory(TimePoint now, const Job& job) const;
    void forget_line();
    void step(TimePoint now);
    bool start_next(TimePoint now);
    void start(TimePoint now, Group group);

    void check_active(TimePoint now);
    void conclude(TimePoint now, Verdict verdict);
    void end_broadcast(TimePoint now);
    Facts facts_of_reply(TimePoint now, const Station& station, bool early) const;
    Facts facts_of_others(TimePoint now, const Claims& claims) const;
    Facts facts_of_equals(TimePoint now, const Station& station, bool early) const;
    bool takes_reply(TimePoint now, Station& station, bool early);
    Duration holds_answer(TimePoint now, const ReplyHabits& habits) const;
    void learn_pace(bool early);
    void settle(TimePoint now);
    void doubt_as_early(TimePoint now);
    void ask_again(TimePoint now);
    void confirm(TimePoint now, const Group& group, ByteView reply, bool shows_echo);
    bool is_confirmed(TimePoint now, const Group& group, ByteView reply, bool shows_echo);
    bool has_values(const Group& group, ByteView reply);
    static Group confirming(Group& write, const Station& station);
    void learn_from_failure(TimePoint now, const Attempt& attempt, Verdict verdict);
    void fail(TimePoint now, Verdict verdict);
    void give_back(Group& group);
    void finish_barred(Group& group);
    void give_up(TimePoint now, const Group& group, Fault fault);
    void explain_condition(TimePoint now, std::uint8_t station, Condition before);
    Attempt take_active(TimePoint now);
    void expire(TimePoint now);
    void expire_active(TimePoint now);
    Attempt::Ends ends_attempt(TimePoint now) const;
    void hear(TimePoint now, ByteView bytes);
    void hear_piece(TimePoint now, const modbus::AsciiTranscript::Piece& piece);
    void hear_idle(TimePoint now, ByteView bytes);
    TimePoint idle_ends() const;
    void judge_idle(TimePoint now);
    void note(TimePoint now, const std::vector<modbus::Unused>& parts);
    void note_idle(TimePoint now, std::vector<modbus::Unused> heard);
    void hear_again(TimePoint now, std::uint8_t station, ByteView pdu);

    Settings settings_;
    modbus::CrcOrders orders_;
    std::optional<modbus::AsciiTranscript> ascii_;  ///< converts what is heard to RTU
    Stations stations_;
    Schedule schedule_;
    Quiet quiet_;
    UnsolicitedFrames unsolicited_;
    Pace pace_;
    WakeLatency wake_latency_;
    ReadCache memory_;
    Ticket last_ticket_ = 0;
    EchoMemory echo_memory_;
    Outbox outbox_;
    std::optional<Attempt> active_;
    TimePoint rest_{};  ///< of the wire; kept when the line is reopened
    bool up_ = false;
    bool suspended_ = false;  ///< the line is being replaced, or about to be
    bool resetting_ = false;  ///< the line is to be reopened: nothing is sent
    Transaction transactions_ = 0;
    Duration latency_{};
    Duration lead_{};
    bool confirm_ends_ = false;
};

}  // namespace panelgate::arbiter
