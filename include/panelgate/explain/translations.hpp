#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/alarms/settings.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/points/station_points.hpp"

namespace panelgate::explain {

// The configuration translated for each module.

bus::Settings bus_settings(const config::Line& line);
/// The stations that have points or poll blocks.
std::vector<points::PolledStation> polled_stations(const config::Line& line);
/// Describes which items of the panel share memory.
points::SharedMemory memory_of(const profile::ProfileRef& panel);
/// True if the panel has function 15 or 16 for this table.
bool takes_multiple(const profile::PanelProfile& panel, modbus::Table table);
/// The wire of a line, whatever its name: its device with links resolved, or the far end.
std::string wire_of(const config::Line& line);
/// True if its panels are simulated, whatever its device is.
bool is_simulated(const config::Line& line, bool simulate);
/// True if the line can continue without reopening: nothing has changed that must be right before
/// the first byte.
bool is_same_wire(const config::Line& before, const config::Line& now, bool simulate);

/// Whoever may publish or subscribe at the broker: the gateway knows no more of them.
WhoRef client_of(const mqtt::Settings& settings);

/// What the rules of `access` let the broker's clients read is published.
class BrokerSight {
  public:
    explicit BrokerSight(const config::Config& config) : who_(client_of(*config.mqtt)) {
        for (const config::Line& line : config.lines) {
            for (const config::Station& station : line.stations)
                rules_[&station] = line.access.rules.get();
        }
    }
    bool line(const config::Line& one) const {
        return one.access.rules == nullptr || one.access.rules->may_read_some(who_);
    }
    bool station(const config::Station& one) const {
        const access::LineRules* rules = rules_.at(&one);
        return rules == nullptr || rules->may_some(who_, one.id, access::Act::read);
    }
    bool point(const config::Station& one, const points::Point& point) const {
        const access::LineRules* rules = rules_.at(&one);
        if (rules == nullptr) return true;
        const modbus::Span items{point.table, point.address, point.count()};
        return rules
            ->judge(who_, one.id, access::Act::read, modbus::read_function(point.table), items)
            .allowed;
    }
    /// `one`: of this configuration. An alarm of no place is seen by who sees every line.
    bool alarm(const config::Config& config, const alarms::Settings& one) const;

  private:
    bool sees_all(const config::Config& config) const {
        return std::ranges::all_of(config.lines,
                                   [this](const config::Line& one) { return line(one); });
    }

    WhoRef who_;
    std::map<const config::Station*, const access::LineRules*> rules_;
};

/// Returns what a session publishes: lines, then stations with points, each sorted by name, so that
/// another order in the file does not renew the session.
mqtt::Subjects subjects_of(const config::Config& config);
/// True if a session at the broker can go on: its settings and what it publishes are the same.
bool is_same_session(const config::Config& before, const config::Config& now);

template <class One>
void sort_by_name(std::vector<const One*>& all) {
    std::ranges::sort(all, {}, [](const One* one) -> const std::string& { return one->name; });
}

/// In the order of their names; the list outlives the result.
template <class List>
auto by_name(const List& list) {
    std::vector<const typename List::value_type*> sorted;
    for (const auto& one : list) sorted.push_back(&one);
    sort_by_name(sorted);
    return sorted;
}

}  // namespace panelgate::explain
