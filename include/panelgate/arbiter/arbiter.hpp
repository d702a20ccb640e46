#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/arbiter/bus_shares.hpp"
#include "panelgate/arbiter/copy_guard.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/late_window.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/shared_read.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/arbiter/turnaround.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// Write these bytes in one piece, now.
struct Transmit {
    Bytes adu;
};
/// A job is done: its one and only answer.
struct Finish {
    Ticket ticket = 0;
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< at least once, at least partly
    bool shared = false;       ///< another job's transaction answered it too
    /// Of a value that was read before and answers from memory (max_age).
    std::optional<Duration> age;
};
/// Something was seen on the wire, for the trace.
struct Note {
    enum class Direction : std::uint8_t { sent, received, discarded };
    TimePoint at;  ///< first bit out, or last byte in
    Direction direction = Direction::sent;
    Bytes bytes;
    std::string_view what;  ///< a literal: "request", "reply", "foreign"…
    std::string why;        ///< of a sent frame, with Settings::explain: why this one now
};
/// With Settings::explain: why something is not done now, or not at all. One line.
struct Decision {
    TimePoint at;
    std::string text;
};
/// A station changed its health, or showed something that its owner should know.
struct StationEvent {
    enum class Kind : std::uint8_t {
        offline,
        online,
        late,       ///< it answered `by` after the response timeout
        drift,      ///< 95 of 100 replies take up to `by`: near the response timeout
        collision,  ///< the echo of a request to it differed from what was sent
        echo,       ///< a request to it came back: the line hears itself
    };
    Kind kind = Kind::online;
    std::uint8_t station = 0;
    Duration by{};
};
/// Close the way to the wire and open it again, so that nothing that was sent on it is answered any
/// more: then on_line_down and on_line_up.
struct Reset {
    std::string_view why;  ///< a literal, for people
};
using Action = std::variant<Transmit, Finish, Note, Decision, StationEvent, Reset>;

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
class Arbiter {
  public:
    explicit Arbiter(Settings settings);

    /// Accepts a job (its deadline is set here), or a fault at once: busy, line_down, offline. An
    /// accepted job gets exactly one Finish.
    Result<Ticket> submit(TimePoint now, Job job);
    /// The client is gone: what it has waiting is finished as cancelled and never transmitted.
    void cancel(TimePoint now, Client client);
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
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
    bool wants_end(TimePoint now) const {
        return active_ && !active_->end_confirmed && now >= active_->sent;
    }
    /// `left`: the time that the wire still needs. More than nothing moves the end, and with it the
    /// timeout or the turnaround; wants_end() comes again then, up to a second after the computed
    /// end.
    void on_end(TimePoint now, Duration left);

    std::optional<Action> poll_action();
    /// When to call on_deadline next; nothing when only an event can change anything.
    std::optional<TimePoint> next_deadline() const;

    std::size_t queue_depth() const { return queue_.size(); }
    /// Nothing waits and no client's request is on the wire.
    bool idle() const {
        return queue_.empty() && retries_.empty() && (!active_ || active_->group.jobs.empty());
    }
    const LineCounters& counters() const { return line_counters_; }
    /// By station; those that the settings do not list share the entry 0.
    const std::map<std::uint8_t, StationCounters>& station_counters() const { return counters_; }
    /// Of a station that was never asked: unknown.
    StationHealth health(std::uint8_t id) const;
    /// How long the next request to this station would wait for its reply to begin.
    Duration response_timeout(std::uint8_t id) const;
    const BusShares& shares() const { return shares_; }
    EchoMemory::State echo() const { return echo_memory_.state(); }

  private:
    /// What is known of a station beyond its settings; made when it is first asked.
    struct Station {
        Station(const StationSettings& s, const OfflineSettings& offline)
            : settings(s),
              health(offline),
              late(s.late_window, s.response_timeout),
              adaptive(s.timeout_floor, s.response_timeout) {}

        Duration timeout() const {
            return settings.adaptive_timeout ? adaptive.value(turnaround)
                                             : settings.response_timeout;
        }

        StationSettings settings;
        StationHealth health;
        LateWindow late;
        Turnaround turnaround;
        AdaptiveTimeout adaptive;
        DriftAlarm drift;
        CopyGuard copies;
        TimePoint not_before{};  ///< its quarantine
        Bytes unanswered;        ///< the request whose replies may still come
        int owed = 0;            ///< how many of them
        TimePoint due{};         ///< when the last one should have begun
        Bytes probe;             ///< the cheapest read it has answered
        Bytes last_read;         ///< what to probe with before it has answered any
        Duration slowest{};      ///< longest think time seen
        int probes = 0;          ///< sent so far
    };
    /// Jobs that one transaction answers, and its request. jobs[0] leads; a probe has none.
    struct Group {
        std::vector<Job> jobs;
        std::uint8_t station = 0;
        Bytes pdu;
        std::optional<ReadSpan> span;
        int attempts = 0;
        TimePoint started{};  ///< the first attempt: what answers was not read before
        bool probe = false;
        /// It only finds out about the echo, for this job, which waits in the queue.
        Ticket learns_for = 0;
    };
    /// The transaction on the wire.
    struct Active {
        Group group;
        modbus::ReplyFramer framer;
        TimePoint started;     ///< first bit out
        TimePoint sent;        ///< last bit out, computed, or as the line told
        TimePoint give_up;     ///< no sign of a reply until here: timeout
        TimePoint longest;     ///< a reply that has begun must have ended here
        TimePoint first_byte;  ///< heard in this attempt
        TimePoint last_byte;
        bool heard = false;
        TimePoint computed;  ///< last bit out
        bool end_confirmed = true;
        bool clean = true;  ///< nothing was heard before the reply could begin, but for the echo
        Bytes collided;     ///< instead of the echo
        Duration pause{};   ///< the silence before this attempt
    };

    // What happens next (schedule.cpp)
    void step(TimePoint now);
    bool start_next(TimePoint now);
    bool start_retry(TimePoint now);
    bool start_probe(TimePoint now);
    void start_learning(TimePoint now, const Job& job);
    bool start_job(TimePoint now);
    bool may_run(TimePoint now, const Job& job) const;
    bool gap_is_over(TimePoint now, std::uint8_t station);
    void start(TimePoint now, Group group);
    TimePoint repeat_from(const Group& group) const;
    void forget_empty_retries();
    Group gather(Job leader);
    bool joins(const Group& group, const Job& job) const;
    void expire(TimePoint now);
    void expire_jobs(TimePoint now, std::vector<Job>& jobs);
    std::uint8_t next_to_probe(TimePoint now) const;
    std::optional<TimePoint> next_probe() const;
    std::optional<TimePoint> next_start() const;
    Bytes probe_for(const Station& station) const;
    Duration patience(const Group& group, Station& station) const;
    std::optional<Ticket> answer_from_memory(TimePoint now, const Job& job);
    bool has_open(Client client) const;

    // What a transaction came to (transaction.cpp)
    void check_active(TimePoint now);
    void check_broadcast(TimePoint now);
    void settle(TimePoint now, const Bytes& reply);
    void deliver(const Group& group, const Bytes& reply);
    bool split(Group& group, const Bytes& reply);
    void count_reply(TimePoint now, const Bytes& reply);
    void fail_attempt(TimePoint now, Fault fault);
    void give_up(TimePoint now, const Group& group, Fault fault);
    void quarantine(TimePoint now, const Group& group, Station& station, TimePoint sent);
    void expect_late(TimePoint now, Station& station, TimePoint sent);
    void went_silent(TimePoint now, const Group& group, Station& station);
    bool may_retry(TimePoint now, const Group& group, const Station& station) const;
    void close_active(TimePoint now, const Group& group);
    void finish(const Job& job, Result<Bytes> pdu, bool shared = false);
    ByteView without_echo(TimePoint now, ByteView bytes);
    void collide(TimePoint now, ByteView bytes);
    void note_unused(TimePoint now, const std::vector<modbus::Unused>& parts);
    void hear_idle(TimePoint now, ByteView bytes);
    void judge_idle(TimePoint now);
    void on_good_frame(TimePoint now, const modbus::Unused& part);
    bool is_stale(TimePoint now) const;

    // What the line doctor looks at (symptoms.cpp): counted, and nothing depends on it
    void count_answered(std::size_t reply_size);
    void count_failed(const std::vector<modbus::Unused>& parts);
    void count_damaged(ByteView bytes);
    void count_strays(const std::vector<modbus::Unused>& parts);
    void count_unasked(TimePoint now, const modbus::Unused& part);
    Symptoms& symptoms_of(std::uint8_t station) { return counters_of(station).symptoms; }

    TimePoint active_deadline() const;
    bool is_hearing() const;
    Duration shortest_transaction(const Job& job) const;
    const StationSettings& settings_of(std::uint8_t station) const;
    Station& station_of(std::uint8_t station);
    StationCounters& counters_of(std::uint8_t station);
    Duration gap_of(std::uint8_t station) const;

    // Why (explain.cpp): nothing is put into words when nobody wants to read it
    std::string why(TimePoint now, const Group& group) const;
    void explain_refusal(TimePoint now, const Job& job, Fault fault);
    void explain_quarantine(TimePoint now, const Group& group);
    void explain_end(TimePoint now, const Job& job, Fault fault);

    Settings settings_;
    std::map<std::uint8_t, StationSettings> configured_;
    std::map<std::uint8_t, Station> stations_;
    std::map<std::uint8_t, StationCounters> counters_;
    LineCounters line_counters_;
    JobQueue queue_;
    std::optional<Active> active_;
    /// An attempt failed: the same request goes again. At most one a station that is asked between
    /// (quarantine: station), else one.
    std::deque<Group> retries_;
    std::vector<ReadSpan> refused_spans_;  ///< joined reads that a panel did not take
    ProbeBudget budget_;
    ReadCache cache_;
    BusShares shares_;
    EchoMemory echo_memory_;
    EchoFilter echo_;  ///< of the frame sent last
    std::deque<Action> actions_;
    Bytes idle_heard_;               ///< unasked bytes, until silence ends them
    TimePoint quiet_since_{};        ///< the last bit seen on the line, sent or heard
    TimePoint quiet_until_{};        ///< nothing may be sent before, whatever comes next
    TimePoint quarantined_until_{};  ///< the line's quarantine: only the same request may go again
    std::uint8_t last_station_ = 0;  ///< whose gap follows quiet_since_
    int early_replies_ = 0;          ///< that began before the gap was over: no real UART
    int timely_replies_ = 0;
    std::optional<Duration> slowest_;  ///< think time of all stations that have answered
    bool other_first_ = false;         ///< a retry lets one other go first
    bool up_ = false;
    Duration latency_{};
    Duration lead_{};
    bool confirm_ends_ = false;
    Ticket last_ticket_ = 0;
};

}  // namespace panelgate::arbiter
