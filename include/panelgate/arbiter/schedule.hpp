#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/attempt/attempt.hpp"
#include "panelgate/arbiter/habits/echo.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// Which reads share one transaction (P6), and which joins were refused. Pure.
class Sharing {
  public:
    static constexpr std::size_t kRemembered = 64;

    explicit Sharing(bool share) : share_(share) {}
    void apply(bool share) { share_ = share; }

    /// Returns the leader and the jobs that the same transaction can answer: contained reads
    /// always; touching ones up to the length that the panel is known to answer. Joining adjacent
    /// reads saves a request, a reply header and two gaps.
    Group gather(Job leader, const Station& station, const OutstandingRequests& book,
                 JobQueue& queue) const;
    /// The joined read failed: its parts are sent alone from now on. Returns them in the order in
    /// which to put them back; jobs that asked for the whole, and jobs of clients that have left,
    /// stay in the group.
    Jobs split(Group& group);
    /// Returns the part of `reply` that answers this job of the group.
    static Bytes part_for(const Group& group, const Bytes& reply, const Job& job);

  private:
    bool joins(const Group& group, const Job& job, const Station& station,
               const OutstandingRequests& book) const;

    bool share_;
    PoolDeque<ReadSpan> refused_;
};

/// All accepted jobs that are not on the wire: requests that wait for their turn, and retries.
/// Pure.
class Backlog {
  public:
    explicit Backlog(const QueueSettings& settings) : queue_(settings) {}

    JobQueue& queue() { return queue_; }
    const JobQueue& queue() const { return queue_; }
    bool empty() const { return queue_.empty() && retries_.empty(); }
    /// True if a job of this client waits for this station.
    bool has(Client client, std::uint8_t station) const;

    /// Queues a retry of the same request. At most one per station.
    void retry(Group group) { retries_.push_back(std::move(group)); }
    bool has_retries() const { return !retries_.empty(); }
    bool has_retry(std::uint8_t station) const {
        return std::ranges::any_of(retries_,
                                   [&](const Group& group) { return group.station == station; });
    }
    std::optional<Group> take_retry(const InlineFunction<bool(const Group&), 48>& may_go);
    const PoolDeque<Group>& retries() const { return retries_; }

    /// Takes the retries that no client waits for any more, without their jobs: they count as
    /// failed.
    std::vector<Group> take_dropped() { return std::exchange(dropped_, {}); }

    /// Removes and returns this client's jobs.
    Jobs cancel(Client client);
    /// Removes and returns the jobs that can no longer be started in time, or, sent before,
    /// answered in time.
    Jobs expire(TimePoint now);
    std::optional<TimePoint> first_expiry() const;
    /// Removes and returns the matching jobs whose request waits to be sent again.
    Jobs remove_retries(const JobQueue::Test& match);
    /// Removes and returns all jobs.
    Jobs clear();

  private:
    JobQueue queue_;
    PoolDeque<Group> retries_;
    std::vector<Group> dropped_;
};

/// Decides what is sent next on a free line: a retry, a probe, or a request in turn, with the jobs
/// that it also answers. Changes only the backlog. Pure.
class Schedule {
  public:
    explicit Schedule(const Settings& settings);

    void apply(const Settings& settings);

    struct Next {
        std::optional<Group> group;  ///< empty: nothing now
        bool reopen = false;         ///< the line must be reopened first
    };
    Next next(TimePoint now, Stations& stations, Quiet& quiet, const EchoMemory& echo);
    /// When next() may decide otherwise; empty: only after an event.
    std::optional<TimePoint> next_start(const Stations& stations, const Quiet& quiet) const;

    /// P1: time until which the whole line rests, because late replies occurred before or the
    /// configuration says so: one would collide with requests to other stations. Probes never make
    /// the line rest; with an adaptive timeout the rest is shorter.
    std::optional<TimePoint> line_rests_until(TimePoint now, const Group& failed, TimePoint sent,
                                              const Station& station) const;

    /// True if the station's outstanding requests or replies may still be in transit, however long
    /// ago, where the transport may stall (Settings::may_stall).
    bool in_transit(const Stations& stations, const Station& station) const {
        return may_stall_ && stations.book().any_since(station.id(), stations.book().proved()) &&
               !station.replies().answered_since_reopen();
    }

    Backlog& backlog() { return backlog_; }
    const Backlog& backlog() const { return backlog_; }
    /// Queues a retry that may cost others `patience`. While only its station rests, other stations
    /// go first, for no longer than that: one request, or one per waiting station if all retries
    /// that wait may take long.
    void retry(TimePoint now, Group group, Duration patience, const Stations& stations);
    /// Puts the parts of a joined read back, each alone. Returns the jobs whose client has left:
    /// they are not sent again.
    Jobs give_back(Group& group);

  private:
    /// The line that is free now.
    struct Line {
        TimePoint now;
        Stations& stations;
        Quiet& quiet;
        const EchoMemory& echo;
    };
    static bool gap_is_over(const Line& line, std::uint8_t station);
    std::optional<Group> next_retry(const Line& line);
    std::optional<Group> next_probe(const Line& line) const;
    Next next_job(const Line& line);
    JobQueue::Choice own_turn(const Line& line, JobQueue::Choice next,
                              const JobQueue::Test& may_run) const;
    std::optional<Next> proof_before(const Line& line, const Job& job) const;
    std::optional<Next> read_before(const Line& line, const Job& job);
    bool may_run(const Line& line, const Job& job) const;
    TimePoint ready_at(const Stations& stations, const Job& job) const;
    TimePoint repeat_from(const Group& group, const Stations& stations) const;
    bool can_prove(const OutstandingRequests& book, const Station& station) const;
    bool others_go_first(const Line& line) const;
    void let_others_go_first(TimePoint now, const Stations& stations);
    bool has_turn(const Job& job) const;
    void take_turn(const Job& job);

    Quarantine quarantine_;
    bool may_stall_;
    bool echo_known_ = false;
    Backlog backlog_;
    Sharing sharing_;
    Ticket learned_for_ = 0;        ///< a read was sent for it to detect the echo (P8)
    PoolSet<std::uint8_t> others_;  ///< stations that waited when a retry was due
    PoolSet<std::uint8_t> wrote_;   ///< those of them whose turn was a write
    std::size_t turns_ = 0;         ///< turns that the retry leaves to them, at most
    Duration patience_{};           ///< time that retries may cost them, since one waits
    TimePoint others_since_{};      ///< begin of the time that the retry leaves to them
};

}  // namespace panelgate::arbiter
