#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/backlog.hpp"
#include "panelgate/arbiter/broadcast_replies.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/sharing.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/arbiter/way.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

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
