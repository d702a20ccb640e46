#pragma once

#include <map>
#include <optional>

#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/station_health.hpp"

namespace panelgate::arbiter {

/// All stations of a line: made when they are first asked, strangers forgotten again. Knows what
/// those that do not answer may cost together, and whose probe is due. Pure.
class Stations {
  public:
    explicit Stations(const Settings& settings);

    /// What is known of stations that both list stays.
    void apply(const Settings& settings);

    Station& of(std::uint8_t id);
    const Station* find(std::uint8_t id) const;
    /// The configured ones, or those for unlisted stations.
    const StationSettings& settings(std::uint8_t id) const;
    /// The silence that this station wants in front of a request and behind its reply.
    Duration gap(std::uint8_t id) const;
    /// The longest that any station of the line has needed.
    std::optional<Duration> slowest() const { return slowest_.value(); }
    /// Bytes of nobody behind this station's reply.
    void on_trail(TimePoint now, std::uint8_t id) {
        const auto found = stations_.find(id);
        if (found != stations_.end()) found->second.on_stray_bytes(now);
    }
    /// A station has answered a broadcast, as none should.
    void on_broadcast_answered(std::uint8_t id) {
        const auto found = stations_.find(id);
        if (found != stations_.end()) found->second.on_broadcast_answered();
    }
    /// Bytes that are no frame.
    void on_damaged(TimePoint now, ByteView bytes) {
        for (auto& [id, station] : stations_) station.on_damaged_bytes(now, id, bytes);
    }
    void on_line_down() {
        for (auto& [id, station] : stations_) station.on_line_down();
    }
    /// A request that left at `sent` was answered now, on a line that may hold things back.
    void on_opened(TimePoint now) {
        for (auto& [id, station] : stations_) station.on_opened(now);
    }
    void on_proved(TimePoint now, TimePoint sent) {
        for (auto& [id, station] : stations_) station.on_proved(now, sent);
    }
    /// A station is back, or the line is open again: others may be back for the same reason and are
    /// asked at once.
    void on_back() { probes_.clear(); }
    /// `waited` from request to first sign; nothing: that cannot be told.
    void on_reply(TimePoint now, std::optional<Duration> waited) {
        heard_ = now;
        if (!waited) return;
        slowest_.add(*waited);
        quickest_.add(*waited);
    }
    /// The shortest that any station of the line has needed lately.
    const Quickest& quickest() const { return quickest_; }

    /// From when on nothing is owed that could still come; `may_stall`: on a way that holds things
    /// back, as from now on.
    TimePoint clear_at(TimePoint now, bool may_stall) const;
    /// Behind a request: within its timeout, and so much later as it may be late.
    Duration latest_reply(std::uint8_t id) const;

    StationHealth health(std::uint8_t id) const;
    Duration response_timeout(std::uint8_t id) const;
    /// The station is offline, and this is not to be its probe. Of a stranger any request may be.
    bool refuses(TimePoint now, const Job& job);
    /// How long the next attempt waits for its reply to begin.
    Duration patience(TimePoint now, const Group& group);
    /// It fails so often that its silence surprises nobody: others who want the line do not pay for
    /// it.
    bool spent(TimePoint now, const Station& station) const {
        return station.flaky() && has_company(now, station);
    }
    /// Before on_failed(): a retry is within what this station may cost the others.
    bool affords_retry(TimePoint now, const Station& station) const {
        return !spent(now, station) && (station.may_spend(now) || !has_company(now, station));
    }
    /// The budgets for stations that do not answer allow asking this one. One that has just fallen
    /// silent, that keeps failing, or that nobody knows waits for them only while others want the
    /// line.
    bool may_spend(TimePoint now, const Job& job) const;
    /// Until then a station that keeps failing waits for its share: others want the line, though
    /// none of their requests may wait at this moment (a client that asks one by one).
    TimePoint held_until(std::uint8_t id) const;
    /// An attempt failed that kept the line for `cost`.
    void on_failed(TimePoint now, const Group& group, Verdict verdict, Duration cost);
    /// A read of this station that waits goes before its writes.
    bool has_read_turn(std::uint8_t id) const {
        const Station* station = find(id);
        return station != nullptr && station->has_read_turn();
    }

    /// The listed station, offline or unanswering to writes, whose probe is due longest; nothing
    /// when none is.
    std::optional<std::uint8_t> next_to_probe(TimePoint now) const;
    /// When the next probe is due.
    std::optional<TimePoint> next_probe() const;
    /// Drops the strangers that nobody has asked for lately.
    void forget_strangers(TimePoint now);

  private:
    bool anyone_online() const;
    /// When it is asked though nobody wants anything of it; nothing: never.
    std::optional<TimePoint> probe_at(const Station& station) const;
    bool is_stranger(std::uint8_t id) const;
    /// Another station has answered lately, and after this one failed: the line is well.
    bool has_company(TimePoint now, const Station& station) const {
        return now < company_until(station);
    }
    /// Others have answered behind its last failure: so long they are taken to want the line.
    TimePoint company_until(const Station& station) const;
    /// How long a failing station's share of the bus has to add up to pay for one full silence.
    Duration surprise() const {
        return static_cast<int>(1 / ProbeBudget::kFailing) * unlisted_.response_timeout;
    }
    /// What those that are offline may take: more while an outage of all has only just begun.
    const ProbeBudget& probes() const {
        const bool all_just_died = !anyone_online() && alone_.next() < heard_ + kOutage;
        return all_just_died ? alone_ : probes_;
    }

    static constexpr Duration kOutage = 30s;
    static constexpr Duration kHurry = 5s;    ///< at most
    static constexpr Duration kCompany = 5s;  ///< who has answered since then wants the line

    OfflineSettings offline_;
    StationSettings unlisted_;
    Duration standard_gap_{};
    Duration frame_{};  ///< what a usual reply takes on this line
    std::map<std::uint8_t, StationSettings> configured_;
    std::map<std::uint8_t, Station> stations_;
    ProbeBudget probes_{ProbeBudget::kOffline};
    ProbeBudget alone_{ProbeBudget::kAlone};
    ProbeBudget suspects_{ProbeBudget::kFailing};
    ProbeBudget strangers_{ProbeBudget::kFailing};          ///< all attempts at strangers
    ProbeBudget known_strangers_{ProbeBudget::kStrangers};  ///< ... but the first at each
    Slowest slowest_;
    Quickest quickest_;
    TimePoint heard_{};        ///< any of them
    TimePoint hurry_until_{};  ///< one has just been waited for in vain: the next ones are not
};

}  // namespace panelgate::arbiter
