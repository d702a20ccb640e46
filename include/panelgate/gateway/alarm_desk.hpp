#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/alarms/alarms.hpp"
#include "panelgate/gateway/journal.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// Watches the alarms' conditions: values as they are read, all else once a second. Changes go into
/// the journal, states into the store, so that both outlive a restart. An object of the plant's
/// loop.
class AlarmDesk : public web::AlarmSource {
  public:
    using Listener = std::function<void(const alarms::Change&)>;
    /// An alarm as it is now, for whoever keeps a copy.
    using Announcement = std::function<void(const alarms::Settings&, const alarms::Status&)>;
    /// The findings of the gateway itself, as they are now.
    using Findings = std::function<const std::vector<web::Finding>&()>;

    /// Clock and journal outlive the desk. `tell` gets each change; `announce` each change, too,
    /// and all alarms once their states are known, and after each apply().
    AlarmDesk(rt::Clock& clock, Journal& journal, Findings findings, Listener tell,
              Announcement announce);
    AlarmDesk(const AlarmDesk&) = delete;
    AlarmDesk& operator=(const AlarmDesk&) = delete;

    /// Watches these alarms of this plant from now on. The first time their states are read from
    /// the store; nothing is watched before.
    void apply(const std::vector<alarms::Settings>& settings, std::shared_ptr<const Plant> plant);
    void stop() { alarm_->cancel(); }
    /// Values of the points among these wants of the station's polls.
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    /// Announces every alarm, if the states are known already.
    void announce_all() const;
    std::vector<web::AlarmView> list() const override;
    Acknowledged acknowledge(const std::string& name, const std::string& who) override;

    /// The line of the alarm's station, or its own; "": the alarm has none.
    std::string line_of(const alarms::Settings& alarm) const;

  private:
    /// What alarms look at besides values.
    struct Sights {
        std::set<std::string> down{};      ///< lines
        std::set<std::string> findings{};  ///< causes
    };

    alarms::Alarms::Time time() const;
    void restore(const std::vector<std::pair<std::string, std::string>>& kept);
    void look();
    Sights look_around() const;
    std::optional<alarms::Change> look_at(std::size_t alarm, const Sights& sights);
    void on_change(const std::optional<alarms::Change>& change);

    rt::Clock& clock_;
    Journal& journal_;
    Findings findings_;
    Listener tell_;
    Announcement announce_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    alarms::Alarms alarms_;
    std::shared_ptr<const Plant> plant_;
    std::multimap<std::string, std::size_t> by_point_;  ///< alarms by "STATION/POINT"
    bool asked_ = false;                                ///< the store was asked for states
    bool ready_ = false;                                ///< ... and has answered
};

}  // namespace panelgate::gateway
