#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/arbiter/timing.hpp"

namespace panelgate::arbiter {

/// All stations of a line: created when first asked; unheard ones are forgotten again. Two budgets
/// hold what silence may cost the others, by asking seldom (P4, T1): suspects, offline ones. Pure.
class Stations {
  public:
    explicit Stations(const Settings& settings) { apply(settings); }

    /// Keeps what is known of stations that both settings list.
    void apply(const Settings& settings);

    const Outstanding& outstanding() const { return outstanding_; }
    Outstanding& outstanding() { return outstanding_; }
    Station& of(std::uint8_t id);
    const Station* find(std::uint8_t id) const;
    Station* find(std::uint8_t id);
    /// The station's settings, or those for unlisted stations.
    const StationSettings& settings(std::uint8_t id) const;
    /// Silence required before a request to this station and after its reply.
    Duration gap(std::uint8_t id) const;
    /// What the slowest station of the line needed lately; empty: none was heard.
    std::optional<Duration> slowest() const;
    /// How long after a request its reply may still come: its timeout and late window.
    Duration latest_reply(std::uint8_t id) const;
    Duration response_timeout(std::uint8_t id) const;
    StationHealth health(std::uint8_t id) const;
    Condition condition(std::uint8_t id) const;

    /// True if the station is offline and this job is not its probe: a client's write may be, and
    /// any request to an unlisted station, once an interval and within the budget.
    bool refuses(TimePoint now, const Job& job);
    /// True if the budget of suspects allows to ask this station while others wait.
    bool may_spend(TimePoint now, const Job& job) const;
    /// Time until which a suspect waits for its share while others use the line.
    TimePoint held_until(TimePoint now, const Job& job) const;
    /// True if a retry is within what failures may cost the others: behind damage the share of the
    /// station; where several stations fail, and frames do not get lost, that of all suspects, too.
    bool affords_retry(TimePoint now, const Station& station, bool damaged) const;
    /// True if frames get lost on this line: two retries behind silences were answered lately (T1).
    bool loses_frames(TimePoint now) const {
        return lost_before_ != TimePoint{} && now < lost_before_ + timing::kLosesFrames;
    }
    /// An offline station is asked, or a request to it accepted: paid for in advance.
    void on_probe(TimePoint now, std::uint8_t id);
    /// An attempt that occupied the line for `cost` failed.
    void on_failed(TimePoint now, std::uint8_t id, bool is_read, Duration cost);
    /// A station has answered (Station::on_reply()); `retried`: behind a silence.
    void on_reply(TimePoint now, bool retried);
    /// A station is back: more may be back for the same reason, so the budget of probes is new.
    void on_recovery() { offline_.clear(); }
    /// The line was opened: all stations may be there.
    void on_opened(TimePoint now) {
        outstanding_.on_opened();
        on_recovery();
        lively_ = now;
    }
    /// A broadcast has left: stations need their time behind it as behind any write (T14).
    void on_broadcast(const Asked& broadcast);
    void on_line_down();

    /// The listed station whose probe is most overdue; empty: none is due.
    std::optional<std::uint8_t> next_to_probe(TimePoint now) const;
    /// When the next probe is due; empty: never.
    std::optional<TimePoint> next_probe(TimePoint now) const;
    /// Returns a read that shows whether the station is there: a proof, or, without a known read, a
    /// read whose reply may at most be the reply to an earlier attempt of the read.
    modbus::Request probe_for(TimePoint now, const Station& station) const;
    /// A read whose normal reply proves that the station has served all earlier requests (T2): of
    /// another length than each outstanding reply, and a part of a read that it has answered, or
    /// longer by one item. Empty: none is known.
    std::optional<modbus::Request> proof_for(TimePoint now, const Station& station) const;

  private:
    std::optional<TimePoint> probe_at(TimePoint now, const Station& station) const;
    /// From when a request is within the share of its station and the budget of suspects (P4).
    TimePoint affordable_at(TimePoint now, const Station& station, bool is_read) const;
    /// Until when the other stations use the line: kOthersActive behind their last reply, if that
    /// reply came after `since`.
    TimePoint others_active_until(std::uint8_t id, TimePoint since, Client self = 0) const;
    /// True if the budget of suspects holds requests to this station (P4).
    bool is_doubtful(TimePoint now, const Station& station, bool is_read) const;
    std::ptrdiff_t failing_beside(const Station& station) const;
    bool any_online() const;
    const ProbeBudget& probes(TimePoint now) const;
    /// In advance: two timeouts.
    Duration credit() const { return 2 * suspects_.time_for(unlisted_.response_timeout); }
    void forget_unheard(TimePoint now);

    OfflineSettings offline_settings_;
    StationSettings unlisted_;
    Duration standard_gap_{};
    Duration frame_{};  ///< duration of a usual reply on this line
    std::map<std::uint8_t, StationSettings> configured_;
    std::map<std::uint8_t, Station> stations_;
    Outstanding outstanding_;
    ProbeBudget suspects_{ProbeBudget::kSuspect};
    ProbeBudget ignored_writes_{ProbeBudget::kIgnored};  ///< reads do not pay for them (T14)
    ProbeBudget offline_{ProbeBudget::kOffline};
    ProbeBudget alone_{ProbeBudget::kAlone};
    TimePoint lost_{};         ///< when a retry behind a silence was answered, the last time
    TimePoint lost_before_{};  ///< and the time before
    TimePoint lively_{};       ///< the last reply of any station, or when the line was opened
};

}  // namespace panelgate::arbiter
