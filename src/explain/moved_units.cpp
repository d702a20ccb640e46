// Units that lead to another panel after a reload.

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/setting.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/explain/unit_map.hpp"

namespace panelgate::explain {

namespace {

/// The lines of a configuration, and the line that each station is on, by name.
struct Places {
    explicit Places(const config::Config& config) {
        for (const config::Line& one : config.lines) {
            lines.emplace(one.name, &one);
            for (const config::Station& station : one.stations)
                stations.emplace(station.name, &one);
        }
    }
    const config::Line* line_named(const std::string& name) const {
        const auto found = lines.find(name);
        return found == lines.end() ? nullptr : found->second;
    }

    std::map<std::string_view, const config::Line*> lines;
    std::map<std::string_view, const config::Line*> stations;
};

/// Where a request to a unit goes.
struct Destination {
    const config::Line* line = nullptr;        ///< nullptr: all lines of the listener
    std::uint8_t id = 0;                       ///< 0: a broadcast
    const config::Station* station = nullptr;  ///< nullptr: a broadcast, or not listed
    std::string image{};                       ///< "image plant"; "": a panel
};

/// Where the units of a listener or serial master lead, to compare it with another configuration.
class UnitRoutes {
  public:
    /// The settings and places outlive it.
    UnitRoutes(const Places& places, const tcp_server::Settings& settings, tcp_server::UnitMap map)
        : places_(&places), settings_(&settings), map_(std::move(map)) {}

    const Places& places() const { return *places_; }
    /// The units for which the configuration names a station, and 0, which may reach all.
    std::set<std::uint8_t> named() const;
    /// Returns nothing for a unit whose requests reach no panel.
    std::optional<Destination> destination(std::uint8_t unit) const;
    /// The lines that a broadcast to unit 0 reaches.
    const std::vector<std::string>& lines() const { return settings_->lines; }

  private:
    std::optional<Destination> route(std::uint8_t unit) const;

    const Places* places_;
    const tcp_server::Settings* settings_;
    tcp_server::UnitMap map_;
};

std::set<std::uint8_t> UnitRoutes::named() const {
    std::set<std::uint8_t> units{0};
    for (unsigned unit = 1; unit <= 255; ++unit)
        if (map_.is_listed(static_cast<std::uint8_t>(unit)))
            units.insert(static_cast<std::uint8_t>(unit));
    return units;
}

std::optional<Destination> UnitRoutes::destination(std::uint8_t unit) const {
    std::optional<Destination> found = route(unit);
    if (!found) return found;
    const bool denied = found->id == 0 && settings_->broadcast == tcp_server::BroadcastMode::deny;
    const bool only_listened_to = found->line != nullptr && found->line->listens;
    if (denied || only_listened_to) found.reset();
    return found;
}

std::optional<Destination> UnitRoutes::route(std::uint8_t unit) const {
    if (!map_.is_alias(unit)) {
        if (settings_->diagnostics_unit == unit) return std::nullopt;
        if (unit == 0) return Destination{};
    }
    const auto place = map_.place(unit);
    if (!place) return std::nullopt;
    const config::Line* line = places_->line_named(place->line);
    if (line == nullptr) return Destination{nullptr, place->station, nullptr, place->line};
    const auto station = std::ranges::find(line->stations, place->station, &config::Station::id);
    const bool is_listed = station != line->stations.end();
    return Destination{line, place->station, is_listed ? &*station : nullptr};
}

/// A line keeps its name or, renamed, its device.
bool is_same_line(const config::Line* before, const config::Line* after) {
    if (before == nullptr || after == nullptr) return before == after;
    if (before->name == after->name) return true;
    return before->kind != config::Line::Kind::simulated &&
           before->device.device == after->device.device;
}

/// A station that is elsewhere now, or was elsewhere before, is another panel; where only the name
/// at a place has changed, it is the same one.
bool is_same_panel(const Destination& was, const Destination& is, const Places& before,
                   const Places& after) {
    if (!was.image.empty() || !is.image.empty()) return was.image == is.image;
    const bool both_listed = was.station != nullptr && is.station != nullptr;
    if (both_listed && was.station->name == is.station->name) return true;
    if (was.id != is.id || !is_same_line(was.line, is.line)) return false;
    const bool went = was.station != nullptr && after.stations.contains(was.station->name);
    const bool came = is.station != nullptr && before.stations.contains(is.station->name);
    return !went && !came;
}

std::string destination_text(const Destination& place) {
    if (!place.image.empty()) return place.image;
    if (place.line == nullptr) return "a broadcast to all stations";
    const std::string line = " of line " + place.line->name;
    if (place.id == 0) return "a broadcast to all stations" + line;
    if (place.station != nullptr) return '\'' + place.station->name + '\'' + line;
    return "station " + std::to_string(place.id) + line + " (not listed)";
}

/// Returns what prevents that clients write to the wrong panel.
std::string remedy(std::uint8_t unit, const Destination& was, const Destination& is,
                   const Places& after) {
    if (is.id == 0) return "set broadcast: deny, or inform its clients first";
    if (is.image.empty() && is.station == nullptr && is.id == unit)
        return "set unlisted_stations: refuse there, or inform its clients first";
    std::string text = "inform its clients first";
    if (was.station == nullptr) return text;
    const auto place = after.stations.find(was.station->name);
    if (place == after.stations.end()) return text;
    text += ", or keep it with units: {" + std::to_string(unit) + ": " + place->second->name;
    return text + '/' + was.station->name + '}';
}

/// Adds the lines, known before, that a broadcast to unit 0 reaches only now.
void add_wider_broadcast(const std::string& listener, const UnitRoutes& before,
                         const UnitRoutes& after, std::vector<std::string>& all) {
    const auto was = before.destination(0);
    const auto is = after.destination(0);
    if (!was || was->line != nullptr || !is || is->line != nullptr) return;
    for (const std::string& name : after.lines()) {
        const config::Line* line = before.places().line_named(name);
        if (line == nullptr || std::ranges::find(before.lines(), name) != before.lines().end())
            continue;
        all.push_back("unit 0 of " + listener + " reaches line " + name +
                      " as well: a broadcast is now written to its panels too; set broadcast: "
                      "deny, or inform its clients first");
    }
}

void add_moved_units(const std::string& listener, const UnitRoutes& before, const UnitRoutes& after,
                     std::vector<std::string>& all) {
    for (const std::uint8_t unit : before.named()) {
        const auto was = before.destination(unit);
        const auto is = after.destination(unit);
        if (!was || !is || is_same_panel(*was, *is, before.places(), after.places())) continue;
        all.push_back("unit " + std::to_string(unit) + " of " + listener + " was " +
                      destination_text(*was) + " and is now " + destination_text(*is) +
                      ": a write to it may reach another panel; " +
                      remedy(unit, *was, *is, after.places()));
    }
}

/// By the names of listeners and serial masters. `config` and `places` outlive it.
std::map<std::string, UnitRoutes> routes_of(const config::Config& config, const Places& places) {
    std::map<std::string, UnitRoutes> all;
    const auto add = [&](const std::string& name, const auto& settings, Unlisted unlisted) {
        all.try_emplace(name, places, settings, unit_map(settings, config, unlisted));
    };
    for (const auto& [name, listener] : listeners_of(config))
        add(name, *listener, Unlisted::as_the_line);
    for (const serial_server::Settings& master : config.serial_masters)
        add("serial master " + master.name, master.access, Unlisted::refused);
    return all;
}

}  // namespace

std::vector<std::string> moved_units(const config::Config& before, const config::Config& after) {
    const Places places_before(before);
    const Places places_after(after);
    const auto routes_before = routes_of(before, places_before);
    std::vector<std::string> all;
    for (const auto& [name, is] : routes_of(after, places_after)) {
        const auto was = routes_before.find(name);
        if (was == routes_before.end()) continue;
        add_moved_units(name, was->second, is, all);
        add_wider_broadcast(name, was->second, is, all);
    }
    return all;
}

}  // namespace panelgate::explain
