#pragma once

#include <map>
#include <optional>

#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/station_health.hpp"

namespace panelgate::arbiter {

/// All stations of a line and the book of what was asked: created when first asked; unheard ones
/// are forgotten again. Knows what unanswered attempts may cost together, and which probe is due.
/// Pure.
class Stations {
  public:
    explicit Stations(const Settings& settings);

    /// Keeps what is known of stations that both settings list.
    void apply(const Settings& settings);

    const OutstandingRequests& book() const { return book_; }
    OutstandingRequests& book() { return book_; }
    Station& of(std::uint8_t id);
    const Station* find(std::uint8_t id) const;
    /// Returns the station's settings, or those for unlisted stations.
    const StationSettings& settings(std::uint8_t id) const;
    /// Silence required before a request to this station and after its reply.
    Duration gap(std::uint8_t id) const;
    /// Longest recent time that any station of the line has needed.
    std::optional<Duration> slowest() const { return times_.longest(); }
    /// Unsolicited bytes followed this station's reply.
    void on_trail(TimePoint now, std::uint8_t id) {
        const auto found = stations_.find(id);
        if (found != stations_.end()) found->second.on_unsolicited_bytes(now);
    }
    /// A station has answered a broadcast, which is wrong, so long after it.
    void on_broadcast_answered(std::uint8_t id, Duration delay, bool refused) {
        const auto found = stations_.find(id);
        if (found != stations_.end()) found->second.replies().on_broadcast_answered(delay, refused);
    }
    /// Time from which no reply to a broadcast can be taken for the reply to this request.
    TimePoint broadcasts_over(std::uint8_t id, const modbus::Request& request) const {
        const Station* station = find(id);
        if (station == nullptr)
            return book_.broadcasts_over(request, settings(id).response_timeout, false);
        return book_.broadcasts_over(request, station->broadcast_window(),
                                     station->replies().refuses_broadcasts());
    }
    /// Damaged bytes were heard.
    void on_damaged(TimePoint now, ByteView bytes) {
        for (auto& [id, station] : stations_)
            station.replies().on_damaged_bytes(book_, now, bytes, station.settings().crc_order);
    }
    void on_line_down() {
        book_.forget_foreign();
        for (auto& [id, station] : stations_) station.on_line_down();
    }
    /// The line was opened, on a transport that may stall.
    void on_opened(TimePoint now) {
        book_.on_opened(now);
        for (auto& [id, station] : stations_) station.on_opened(book_, now);
    }
    /// A request that left at `sent` was answered now, on a line that may stall.
    void on_proved(TimePoint now, TimePoint sent) {
        book_.on_proved(sent);
        for (auto& [id, station] : stations_) station.replies().on_proved(book_, now, sent);
    }
    /// A station is back, or the line was reopened: others may be back for the same reason and are
    /// asked at once.
    void on_recovery() { probes_.clear(); }
    /// `waited`: from request to first sign of the reply; empty: unknown.
    void on_reply(TimePoint now, std::optional<Duration> waited) {
        heard_ = now;
        if (waited) times_.add(*waited);
    }
    /// Recent times that the stations of the line have needed.
    const RecentTimes& times() const { return times_; }

    /// Time from which no outstanding reply can still come; `may_stall`: on a transport that may
    /// stall, counted from now.
    TimePoint clear_at(TimePoint now, bool may_stall) const;
    /// How long after a request its reply may still come: its timeout and late window.
    Duration latest_reply(std::uint8_t id) const;

    StationHealth health(std::uint8_t id) const;
    Condition condition(std::uint8_t id) const;
    Duration response_timeout(std::uint8_t id) const;
    /// True if the station is offline and this job is not its probe. Any request may probe an
    /// unheard station.
    bool refuses(TimePoint now, const Job& job);
    /// Time that the next attempt waits for its reply to begin.
    Duration patience(TimePoint now, const Group& group);
    /// True if it is flaky while others use the line: they do not pay for its silence.
    bool flaky_beside_others(TimePoint now, const Station& station) const {
        return station.flaky() && others_active(now, station);
    }
    /// Before on_failed(): true if a retry is within what this station may cost the others.
    bool affords_retry(TimePoint now, const Station& station) const {
        return !flaky_beside_others(now, station) &&
               (station.may_spend(now) || !others_active(now, station));
    }
    /// True if the budgets for unanswered attempts allow asking this station. One that has just
    /// fallen silent, keeps failing or is unheard waits for its budget only while others want the
    /// line.
    bool may_spend(TimePoint now, const Job& job) const;
    /// Time until which a failing station waits for its share because others use the line, even if
    /// none of their requests waits now (a client that asks one by one).
    TimePoint throttled_until(std::uint8_t id) const;
    /// An attempt that occupied the line for `cost` failed. `disturbed`: other bytes were heard.
    void on_failed(TimePoint now, const Group& group, Verdict verdict, Duration cost,
                   bool disturbed = false);

    /// Returns the listed station, offline or not answering writes, whose probe is most overdue;
    /// empty if none is due.
    std::optional<std::uint8_t> next_to_probe(TimePoint now) const;
    /// When the next probe is due; empty: none.
    std::optional<TimePoint> next_probe() const;
    /// Drops unheard stations that were not asked for lately.
    void forget_unheard(TimePoint now);

  private:
    StationSettings own_settings(std::uint8_t id) const;
    bool any_online() const;
    /// When it is probed; empty: never.
    std::optional<TimePoint> probe_at(const Station& station) const;
    bool is_speculative(std::uint8_t id) const;
    /// True if another station has answered lately, and it or this one after this one failed: the
    /// line works.
    bool others_active(TimePoint now, const Station& station) const {
        return now < others_active_until(station);
    }
    /// End of the time in which others count as using the line, where something was heard since its
    /// last failure.
    TimePoint others_active_until(const Station& station) const;
    /// Time in which a failing station's share of the line covers one whole timeout.
    Duration timeout_cost() const {
        return static_cast<int>(1 / ProbeBudget::kFailing) * unlisted_.response_timeout;
    }
    /// Budget of offline stations: more while an outage of all has only just begun.
    const ProbeBudget& probes() const {
        const bool all_just_died = !any_online() && alone_.next() < heard_ + timing::kYoungOutage;
        return all_just_died ? alone_ : probes_;
    }

    OfflineSettings offline_;
    StationSettings unlisted_;
    Duration standard_gap_{};
    Duration frame_{};  ///< duration of a usual reply on this line
    std::map<std::uint8_t, StationSettings> configured_;
    std::map<std::uint8_t, Station> stations_;
    ProbeBudget probes_{ProbeBudget::kOffline};
    ProbeBudget alone_{ProbeBudget::kAlone};
    ProbeBudget newly_silent_{ProbeBudget::kFailing};
    ProbeBudget unheard_{ProbeBudget::kFailing};        ///< all attempts at unheard stations
    ProbeBudget asked_unheard_{ProbeBudget::kUnheard};  ///< except the first at each
    OutstandingRequests book_;
    RecentTimes times_;
    TimePoint heard_{};         ///< any of them
    TimePoint urgent_until_{};  ///< one just timed out: shorter waits for others
};

}  // namespace panelgate::arbiter
