#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// Why this group is sent now.
Reason reason_of(TimePoint now, const Group& group, const JobQueue& queue);

/// Joins reads to one transaction (P6), and remembers the joined reads that panels refused. Pure.
class Sharing {
  public:
    static constexpr std::size_t kRemembered = 64;

    explicit Sharing(bool share) : share_(share) {}
    void apply(bool share) { share_ = share; }

    /// Returns the leader and the jobs that the same transaction can answer: contained reads
    /// always; touching ones up to the length that the panel is known to answer. Joining adjacent
    /// reads saves a request, a reply header and two gaps.
    Group gather(TimePoint now, Job leader, const Station& station, const Outstanding& outstanding,
                 JobQueue& queue) const;
    /// The joined read failed: its parts are sent alone from now on. Returns the parts in the order
    /// in which to put them back; jobs for the whole, and of clients that left, stay.
    Jobs split(Group& group);
    /// Returns the part of `reply` that answers this job of the group.
    static Bytes part_for(const Group& group, const Bytes& reply, const Job& job);

  private:
    bool joins(const Group& group, const Job& job, const Station& station) const;

    bool share_;
    PoolDeque<ReadSpan> refused_;
};

/// All accepted jobs that are not on the wire: requests in the queue, and retries. Pure.
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
    bool has_retry(std::uint8_t station) const {
        return std::ranges::any_of(retries_,
                                   [&](const Group& group) { return group.station == station; });
    }
    std::optional<Group> take_retry(const InlineFunction<bool(const Group&), 48>& may_go);
    const PoolDeque<Group>& retries() const { return retries_; }

    /// Takes the retries that no client waits for any more, without jobs: they count as failed.
    std::vector<Group> take_dropped() { return std::exchange(dropped_, {}); }

    /// Removes and returns this client's jobs.
    Jobs cancel(Client client);
    /// Takes out the jobs that can no longer be started, or, sent before, answered in time.
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

/// Decides what is sent next on a free line: a retry, a probe, a proof, or a request in turn with
/// the jobs that the same transaction answers. Changes only the backlog. Pure.
class Schedule {
  public:
    explicit Schedule(const Settings& settings);

    void apply(const Settings& settings);

    /// True if a request to this station may be sent now; `read`: it is one.
    using MayStart = InlineFunction<bool(std::uint8_t station, bool read), 48>;
    /// `may_start`: empty: any may.
    std::optional<Group> next(TimePoint now, Stations& stations, Quiet& quiet,
                              const EchoMemory& echo, const MayStart& may_start = {});
    /// When next() may decide otherwise; empty: only after an event.
    std::optional<TimePoint> next_start(TimePoint now, const Stations& stations,
                                        const Quiet& quiet) const;

    /// T2: time until which the whole line rests behind a request that left at `sent` and was not
    /// answered, because the station has been late before, or the configuration says so: its late
    /// reply would collide with requests to other stations. Probes never make the line rest.
    std::optional<TimePoint> line_rests_until(TimePoint now, const Group& failed, TimePoint sent,
                                              const Station& station) const;

    Backlog& backlog() { return backlog_; }
    const Backlog& backlog() const { return backlog_; }
    /// Queues a retry.
    void retry(Group group) { backlog_.retry(std::move(group)); }
    /// An attempt was silent. Who waits by now for a station that answers goes first, for half a
    /// timeout, unless the line loses frames.
    void on_silence(TimePoint now) { silent_ = now; }
    /// Puts the parts of a joined read back, each alone. Returns the jobs of clients that left.
    Jobs give_back(Group& group);

  private:
    /// The line that is free now.
    struct Line {
        TimePoint now;
        Stations& stations;
        Quiet& quiet;
        const EchoMemory& echo;
        const MayStart& may_start;

        bool takes(std::uint8_t station, bool read) const {
            return !may_start || may_start(station, read);
        }
    };
    static bool gap_is_over(const Line& line, std::uint8_t station);
    std::optional<Group> next_retry(const Line& line);
    std::optional<Group> next_probe(const Line& line) const;
    std::optional<Group> next_job(const Line& line, bool behind_silence);
    std::optional<Group> read_before(const Line& line, const Job& job);
    bool may_run(const Line& line, const Job& job) const;
    TimePoint ready_at(TimePoint now, const Stations& stations, const Job& job) const;
    static TimePoint clear_at(TimePoint now, const Stations& stations, const Station& station,
                              const modbus::Request& request, bool may_learn);
    static TimePoint repeat_from(TimePoint now, const Group& group, const Stations& stations);
    bool others_go_first(const Line& line) const;
    bool goes_first(const Line& line, const Job& job) const;

    Quarantine quarantine_;
    bool echo_known_ = false;
    TimePoint silent_{};  ///< end of the last silent attempt
    Backlog backlog_;
    Sharing sharing_;
    Ticket learned_for_ = 0;  ///< a read was sent for it to show the echo (P8)
};

}  // namespace panelgate::arbiter
