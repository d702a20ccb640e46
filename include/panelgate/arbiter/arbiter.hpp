#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/ledger.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/schedule.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/arbiter/strays.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/ascii.hpp"

namespace panelgate::arbiter {

/// Where jobs come in: they get their ticket and their deadline, or an answer from memory. Pure.
class Reception {
  public:
    explicit Reception(const Settings& settings)
        : serial_(settings.serial), deadline_(settings.queue.deadline) {}

    /// For jobs from now on.
    void apply(const Settings& settings) {
        serial_ = settings.serial;
        deadline_ = settings.queue.deadline;
    }
    /// Its ticket, its deadline, and the last moment at which starting it makes sense: when the
    /// request, a gap and its normal reply still fit. Counting only the shortest reply, an
    /// exception, would fill an overloaded line with transactions whose answers come too late for
    /// everybody.
    void stamp(TimePoint now, Job& job);

    struct FromMemory {
        Ticket ticket = 0;
        ReadCache::Hit hit;
    };
    /// A value that was read lately, where the station's max_age allows it. Not for polls, which
    /// are to bring new ones.
    std::optional<FromMemory> from_memory(TimePoint now, const Job& job, Duration max_age);
    /// A read was answered by its station; `max_age`: of that.
    void on_read(const Group& group, const Bytes& reply, Duration max_age);
    ReadCache& memory() { return memory_; }

  private:
    SerialFormat serial_;
    Duration deadline_;
    ReadCache memory_;
    Ticket last_ticket_ = 0;
};

/// Decides what one line does. Pure: time is an argument, actions come out of poll_action();
/// calling on_deadline early or twice is harmless.
///
///     hand in all bytes that the device holds (on_rx), so that nothing old is taken for new;
///     now = clock; arbiter.on_…(now, …);
///     while (auto action = arbiter.poll_action()) act(*action);
///     alarm at arbiter.next_deadline();
///
/// A line starts down: on_line_up comes first. Acting may call in again: finish the loop, it
/// drains. The promises (P1…P9) are those of the README.
///
// clang-format off
/// | state    | is when                    | leaves on              | then                         |
/// |----------|----------------------------|------------------------|------------------------------|
/// | down     | no on_line_up yet, or down | on_line_up             | quiet; what is owed stays    |
/// | quiet    | Quiet says so: gap, rest   | its end                | retry, probe or next job     |
/// | sending  | an attempt, before its end | its last bit           | broadcast: quiet; waiting    |
/// | waiting  | an attempt, after its end  | reply, damage, timeout | settle, or fail: owed, then  |
/// |          |                            |                        | retry, split or answer       |
/// | resting  | the station owes (Station) | it has come or lapsed  | its jobs may run again       |
/// | doubtful | it lapsed where the line   | Reset, down, up        | as after down                |
/// |          | may stall, unproved        |                        |                              |
// clang-format on
class Arbiter {
  public:
    explicit Arbiter(Settings settings);

    /// Goes on with these. What is owed stays, as does what is known of stations, and what waits.
    /// Only while the line is down or left if it is not is_same_wire().
    void apply(Settings settings);
    /// The line is to be left for another one: nothing more starts, until on_line_up or
    /// on_line_down. What is accepted waits.
    void hold() { held_ = true; }
    bool is_waiting() const { return active_.has_value(); }  ///< for what is on the wire
    /// From when on nothing on its wire is owed, rests or is under way any more, whoever asks next.
    /// By what is known now: nothing may be asked here meanwhile.
    TimePoint clear_at(TimePoint now) const;
    /// Nothing starts before then: somebody else has used the wire.
    void rest_until(TimePoint until);
    /// After hold(), not while is_waiting(): the line is closed, another one will be opened.
    void on_line_left();

    /// Accepts a job (its deadline is set here), or a fault at once: busy, line_down, offline. An
    /// accepted job gets exactly one Finish.
    Result<Ticket> submit(TimePoint now, Job job);
    /// What waits for its first turn and matches is finished as denied and never transmitted: the
    /// rights have changed since it came.
    void deny(TimePoint now, const JobQueue::Test& match);
    /// The client is gone: what it has waiting is finished as cancelled and never transmitted;
    /// what is on the wire is not sent again for it.
    void cancel(TimePoint now, Client client);
    /// What a client is to be called where decisions are explained, until cancel().
    void name_client(Client client, std::string name) { names_.set(client, std::move(name)); }
    const ClientNames& client_names() const { return names_; }
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now) { step(now); }
    void on_line_up(TimePoint now);
    void on_line_down(TimePoint now);

    /// What the way to the wire and back adds to every answer (RTU over TCP), from the next
    /// request on.
    void set_latency(Duration latency) { latency_ = latency; }
    /// What lies between Transmit and the first bit, from the next request on.
    void set_lead(Duration lead) { lead_ = lead; }
    /// The line can tell what has not left yet: from the next request on wants_end() comes true at
    /// the computed end of each, and on_end() is to be told how much is left.
    void confirm_ends(bool confirm) { confirm_ends_ = confirm; }
    bool wants_end(TimePoint now) const { return active_ && active_->wants_end(now); }
    /// `left`: the time that the wire still needs. More than nothing moves the end, and with it the
    /// timeout or the turnaround; wants_end() comes again then, up to a second after the computed
    /// end.
    void on_end(TimePoint now, Duration left);
    /// The request on the wire is out of time and not a byte was heard: whoever drives the line
    /// makes sure that it was delivered, before on_deadline.
    bool is_unheard(TimePoint now) const {
        return active_ && !active_->is_broadcast() && !active_->heard() &&
               now >= active_->deadline();
    }

    std::optional<Action> poll_action() { return ledger_.poll(); }
    /// When to call on_deadline next; nothing when only an event can change anything.
    std::optional<TimePoint> next_deadline() const;

    /// Input that comes before then changes nothing: a reply has begun, and its rest takes as long.
    /// Whoever drives the line need not look at each byte. Nothing: all input is wanted at once.
    std::optional<TimePoint> busy_until() const {
        return active_ && !active_->is_broadcast() ? active_->busy_until() : std::nullopt;
    }

    std::size_t queue_depth() const { return schedule_.backlog().queue().size(); }
    /// Nothing waits and no client's request is on the wire.
    bool idle() const {
        return schedule_.backlog().empty() && (!active_ || active_->group().jobs.empty());
    }
    const LineCounters& counters() const { return ledger_.line(); }
    /// By station; those that the settings do not list share the entry 0.
    const std::map<std::uint8_t, StationCounters>& station_counters() const {
        return ledger_.stations();
    }
    /// Of a station that was never asked: unknown.
    StationHealth health(std::uint8_t id) const { return stations_.health(id); }
    /// How long the next request to this station would wait for its reply to begin.
    Duration response_timeout(std::uint8_t id) const { return stations_.response_timeout(id); }
    const BusShares& shares() const { return ledger_.shares(); }
    EchoState echo() const { return echo_memory_.state(); }
    /// Aborts when what must always hold does not. For tests.
    void check_invariants() const;

  private:
    void step(TimePoint now);
    bool start_next(TimePoint now);
    void start(TimePoint now, Group group);

    void check_active(TimePoint now);
    void conclude(TimePoint now, Verdict verdict);
    void end_broadcast(TimePoint now);
    bool takes_reply(TimePoint now, const Station& station, bool early);
    void settle(TimePoint now);
    void ask_again(TimePoint now);
    void confirm(const Group& group, bool is_answer);
    static Group confirming(Group& write, const Station& station);
    void fail(TimePoint now, Verdict verdict);
    void give_back(Group& group);
    void give_up(TimePoint now, const Group& group, Fault fault);
    Attempt take_active(TimePoint now);
    void expire(TimePoint now);
    void expire_active(TimePoint now);
    Attempt::Ends ends_attempt(TimePoint now) const;
    void hear(TimePoint now, ByteView bytes);
    void hear_piece(TimePoint now, const modbus::AsciiTranscript::Piece& piece);
    void hear_idle(TimePoint now, ByteView bytes);
    void judge_idle(TimePoint now);
    void note(TimePoint now, const std::vector<modbus::Unused>& parts);

    Settings settings_;
    modbus::CrcOrders orders_;
    std::optional<modbus::AsciiTranscript> ascii_;  ///< between the wire and everybody in here
    Stations stations_;
    Schedule schedule_;
    Quiet quiet_;
    Strays strays_;
    Pace pace_;
    Notice notice_;
    int surprised_ = 0;  ///< replies: where one station refuses something, others may do so, too
    Reception reception_;
    EchoMemory echo_memory_;
    Ledger ledger_;
    ClientNames names_;
    std::optional<Attempt> active_;
    TimePoint rest_{};  ///< of the wire, also across a line that is opened anew
    bool up_ = false;
    bool held_ = false;       ///< between two lines, or about to be
    bool resetting_ = false;  ///< the line is to be opened anew: nothing is sent
    Transaction transactions_ = 0;
    Duration latency_{};
    Duration lead_{};
    bool confirm_ends_ = false;
};

}  // namespace panelgate::arbiter
