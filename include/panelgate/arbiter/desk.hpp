#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/outbox.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/arbiter/schedule.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/fault.hpp"

namespace panelgate::arbiter {

/// What a line does for its clients, whatever carries its requests: jobs are accepted, wait, and
/// end once; stations have their health. Its heirs send and hear. Pure.
class Desk {
  public:
    std::optional<Action> poll_action() { return outbox_.poll(); }
    std::size_t queue_depth() const { return schedule_.backlog().queue().size(); }
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

  protected:
    explicit Desk(Settings settings);
    void adopt(Settings settings);

    /// Answers the job from memory or refuses it; empty: the job is accepted and has its ticket.
    /// `has_open`: its client has a request on its way to this station.
    std::optional<Result<Ticket>> answer_at_once(TimePoint now, Job& job, bool has_open);
    /// Queues an accepted job.
    Result<Ticket> enqueue(TimePoint now, Job job);
    void deny_waiting(const JobQueue::Test& match);
    void cancel_waiting(Client client);
    void expire_waiting(TimePoint now);
    void clear_waiting();

    /// The next attempt of this group begins.
    void begin(TimePoint now, Group& group);
    /// The reply is handed on to the jobs of its group.
    void hand_on(Group& group, const Bytes& reply);
    /// The parts of a joined read are sent again, except for clients that have left.
    void give_back(Group& group);
    /// No further attempt: all jobs are answered, and the station is judged.
    void give_up(TimePoint now, const Group& group, Fault fault);
    void explain_condition(TimePoint now, std::uint8_t station, Condition before);

    Settings settings_;
    Stations stations_;
    Schedule schedule_;
    ReadCache memory_;
    Outbox outbox_;
    Ticket last_ticket_ = 0;
    Transaction transactions_ = 0;
    TimePoint now_{};  ///< of the last call
    bool up_ = false;
    bool suspended_ = false;  ///< the line is being replaced, or about to be
    bool resetting_ = false;  ///< the line is to be opened anew: nothing is sent

  private:
    std::optional<ReadCache::Hit> from_memory(TimePoint now, const Job& job, bool has_open) const;
};

}  // namespace panelgate::arbiter
