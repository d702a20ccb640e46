#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// Which reads go together in one transaction (P6), and what came of it. Pure.
class Sharing {
  public:
    static constexpr std::size_t kRemembered = 64;

    explicit Sharing(bool share) : share_(share) {}
    void apply(bool share) { share_ = share; }

    /// The leader and what the same transaction can answer: contained reads always; touching ones
    /// as far as the panel is known to take the length. One request saves a request, a reply header
    /// and two gaps, so joining reads without a hole is always cheaper on the wire.
    Group gather(Job leader, const Station& station, JobQueue& queue) const;
    /// The joined read did not come about: its parts go alone from now on. Gives them in the order
    /// in which they are to be put back in front of the queue; what asked for the whole, and what
    /// nobody waits for any more, stays in the group.
    Jobs split(Group& group);
    /// What of `reply` answers this job of the group.
    static Bytes part_for(const Group& group, const Bytes& reply, const Job& job);

  private:
    bool joins(const Group& group, const Job& job, const Station& station) const;

    bool share_;
    PoolDeque<ReadSpan> refused_;
};

/// All that has been accepted and is not on the wire: requests that wait for their turn, and those
/// whose attempt failed and goes again. Pure.
class Backlog {
  public:
    explicit Backlog(const QueueSettings& settings) : queue_(settings) {}

    JobQueue& queue() { return queue_; }
    const JobQueue& queue() const { return queue_; }
    bool empty() const { return queue_.empty() && retries_.empty(); }
    /// Something of this client waits for this station.
    bool has(Client client, std::uint8_t station) const;

    /// The same request goes again. At most one a station.
    void retry(Group group) { retries_.push_back(std::move(group)); }
    bool has_retries() const { return !retries_.empty(); }
    bool has_retry(std::uint8_t station) const {
        return std::ranges::any_of(retries_,
                                   [&](const Group& group) { return group.station == station; });
    }
    std::optional<Group> take_retry(const InlineFunction<bool(const Group&), 48>& may_go);
    void each_retry(const InlineFunction<void(const Group&), 48>& show) const;

    /// Retries that nobody waits for any more, without their jobs: what failed has failed.
    std::vector<Group> take_dropped() { return std::exchange(dropped_, {}); }

    /// What this client has waiting; it is gone then.
    Jobs cancel(Client client);
    /// Those that can no longer be started, or, transmitted before, answered in time.
    Jobs expire(TimePoint now);
    std::optional<TimePoint> first_expiry() const;
    /// Those that match, waiting for their first turn.
    Jobs remove_if(const JobQueue::Test& match) { return queue_.remove_if(match); }
    /// Everything.
    Jobs clear();

  private:
    Jobs remove_retries(const JobQueue::Test& match);

    JobQueue queue_;
    PoolDeque<Group> retries_;
    std::vector<Group> dropped_;
};

/// What goes next on a line that is free: a retry, a probe, or a request in turn, together with
/// what else it answers. Decides; changes only what waits. Pure.
class Schedule {
  public:
    explicit Schedule(const Settings& settings);

    void apply(const Settings& settings);

    struct Next {
        std::optional<Group> group;  ///< nothing: not now
        bool new_way = false;        ///< the line is to be opened anew first
    };
    Next next(TimePoint now, Stations& stations, Quiet& quiet, const EchoMemory& echo);
    /// When that may say something else; nothing: when something happens.
    std::optional<TimePoint> next_start(const Stations& stations, const Quiet& quiet) const;

    /// P1: where a late reply would collide with what others are told meanwhile, because such have
    /// come before or the configuration says so, everybody rests until then. A probe lets the
    /// others go on in any case; a timeout that was chosen short (adaptive) frees them early.
    std::optional<TimePoint> line_rests_until(TimePoint now, const Group& failed, TimePoint sent,
                                              const Station& station) const;

    /// Where the way to the wire may stall (Settings::may_stall): a connection was made, a request
    /// that was started then was answered.
    void on_way_opened(TimePoint now) { way_.on_opened(now); }
    void on_way_proved(TimePoint started) { way_.on_proved(started); }
    /// What this station owes may still be on its way, whatever the time.
    bool held_back(const Station& station) const {
        return may_stall_ && station.owes_since(way_.proved()) && !station.has_returned();
    }

    /// The last bit of a broadcast has left, or the line was lost under it.
    void on_broadcast(TimePoint sent, ByteView request) { broadcasts_.on_sent(sent, request); }

    Backlog& backlog() { return backlog_; }
    const Backlog& backlog() const { return backlog_; }
    /// The same request goes again and is waited for `patience` long. While only its station rests,
    /// others go first, for no longer than it may take: one request, or, when the retry is dear,
    /// one to each station that waits.
    void retry(TimePoint now, Group group, Duration patience);
    /// The parts of a joined read go again, each by itself. Returns those whose client has left:
    /// they do not.
    Jobs give_back(Group& group);

  private:
    std::optional<Group> next_retry(TimePoint now, const Stations& stations, Quiet& quiet);
    bool others_go_first(TimePoint now, const Stations& stations, const Quiet& quiet) const;
    void let_others_go_first(TimePoint now);
    std::optional<Group> next_probe(TimePoint now, Stations& stations, Quiet& quiet) const;
    Next next_job(TimePoint now, Stations& stations, Quiet& quiet, const EchoMemory& echo);
    std::optional<Next> proof_before(TimePoint now, const Job& job, const Stations& stations) const;
    TimePoint ready_at(const Stations& stations, const Job& job) const;
    bool can_prove(const Station& station) const;
    TimePoint repeat_from(const Group& group, const Stations& stations) const;
    JobQueue::Test runnable(TimePoint now, const Stations& stations, const Quiet& quiet) const;

    Quarantine quarantine_;
    bool may_stall_;
    bool echo_known_ = false;
    Way way_;
    Backlog backlog_;
    Sharing sharing_;
    BroadcastReplies broadcasts_;
    Ticket learned_for_ = 0;        ///< a read was sent for it, to find out about the echo (P8)
    PoolSet<std::uint8_t> others_;  ///< stations that waited when a retry was due
    std::size_t turns_ = 0;         ///< that it leaves to them, at most
    Duration patience_{};           ///< that a retry may cost them
    TimePoint others_until_{};      ///< it leaves them no more time than it may cost
};

}  // namespace panelgate::arbiter
