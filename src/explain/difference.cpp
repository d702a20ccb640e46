#include "panelgate/explain/difference.hpp"

#include <algorithm>
#include <array>
#include <boost/json/object.hpp>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "panelgate/base/text.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/explain/translations.hpp"
#include "panelgate/explain/unit_map.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/tls/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::explain {

namespace {

using config::Distinct;
using config::Setting;
using Kind = Change::Kind;
using Settings = std::map<std::string, Setting>;

/// The two settings at one path; nullptr if one side does not have it.
struct Difference {
    const Setting* before = nullptr;
    const Setting* after = nullptr;
};
using Differences = std::map<std::string, Difference>;

Settings by_path(const config::Config& config) {
    Settings settings;
    for (Setting& setting : config::all_settings(config)) {
        std::string path = setting.path;
        settings.emplace(std::move(path), std::move(setting));
    }
    return settings;
}

Differences compare(const Settings& before, const Settings& after) {
    Differences found;
    for (const auto& [path, setting] : before) {
        const auto other = after.find(path);
        if (other == after.end()) {
            found[path] = {&setting, nullptr};
        } else if (other->second.value != setting.value) {
            found[path] = {&setting, &other->second};
        }
    }
    for (const auto& [path, setting] : after) {
        if (!before.contains(path)) found[path] = {nullptr, &setting};
    }
    return found;
}

bool is_one_sided(const Difference& difference) {
    return difference.before == nullptr || difference.after == nullptr;
}

/// True if a map or list entry above it was added or removed as a whole.
bool is_within(const Differences& all, const std::string& path) {
    for (std::size_t end = path.find('/'); end != path.npos; end = path.find('/', end + 1)) {
        const auto above = all.find(path.substr(0, end));
        if (above != all.end() && is_one_sided(above->second)) return true;
    }
    return false;
}

/// True if the value changes only because the inherited setting changes.
bool follows(const Differences& all, const Difference& difference) {
    if (is_one_sided(difference) || difference.after->otherwise.empty()) return false;
    const auto owner = all.find(difference.after->otherwise);
    if (owner == all.end() || &owner->second == &difference || is_one_sided(owner->second))
        return false;
    return owner->second.before->value == difference.before->value &&
           owner->second.after->value == difference.after->value;
}

// Whether a change protects less

using config::Weaker;
using By = Weaker::By;

/// The place among the ranks, or the number; nothing of a text that is neither.
std::optional<double> size_of(const std::string& text, const Weaker& how) {
    const auto rank = std::ranges::find(how.ranks, text);
    if (rank != how.ranks.end()) return static_cast<double>(rank - how.ranks.begin());
    if (const auto duration = yaml::parse_duration(text)) return to_seconds(*duration);
    double number = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (wrong != std::errc{}) return std::nullopt;
    return number;
}

/// True if the second is larger, or may be; no text is larger than all.
bool is_larger(const std::string& before, const std::string& after, const Weaker& how) {
    if (before.empty() || after.empty()) return after.empty();
    const auto was = size_of(before, how);
    const auto is = size_of(after, how);
    return was && is ? *is > *was : true;
}

std::vector<std::string> items_of(const std::string& list) {
    yaml::Problems problems("");
    std::vector<std::string> items;
    for (const yaml::Node& item : yaml::parse(list, problems).items) items.push_back(item.scalar);
    return items;
}

/// True if the second list has an item that no item of the first one covers.
template <class Covers>
bool has_more(const std::string& before, const std::string& after, const Covers& covers) {
    if (before.empty() || after.empty()) return after.empty();
    const auto known = items_of(before);
    return std::ranges::any_of(items_of(after), [&](const std::string& item) {
        return std::ranges::none_of(known,
                                    [&](const std::string& one) { return covers(one, item); });
    });
}

bool covers_network(const std::string& wide, const std::string& narrow) {
    const auto one = config::parse_cidr(wide);
    const auto other = config::parse_cidr(narrow);
    return one && other && config::covers(*one, *other);
}

bool weakens(const Weaker& how, const Change& change) {
    switch (how.by) {
        case By::nothing:
            return false;
        case By::added:
            return change.kind == Kind::added;
        case By::removed:
            return change.kind == Kind::removed;
        case By::any:
            return true;
        case By::leaving:
            return change.before == how.word;
        case By::coming:
            return change.after == how.word;
        case By::growing:
            return is_larger(change.before, change.after, how);
        case By::falling:
            return !change.before.empty() &&
                   (change.after.empty() || is_larger(change.after, change.before, how));
        case By::more:
            return has_more(change.before, change.after, std::equal_to<>());
        case By::wider:
            return has_more(change.before, change.after, covers_network);
    }
    std::abort();
}

/// The settings of both sides, for rules of two keys.
struct Sides {
    const Settings& before;
    const Settings& after;

    static bool has(const Settings& side, const std::string& path, std::string_view value) {
        const auto found = side.find(path);
        return found != side.end() && found->second.applies && found->second.value == value;
    }
};

/// Changes that depend on a neighbour: limits of a point that is not writable, retries where writes
/// are not repeated, a profile without a guard.
bool is_harmless(const Change& change, const config::KeyShape& key, const Sides& sides) {
    const std::string map = change.path.substr(0, change.path.rfind('/'));
    const std::string& entry = change.kind == Kind::added ? change.path : map;
    if (key.path.starts_with("lines/stations/points"))
        return !Sides::has(sides.after, entry + "/writable", "true");
    if (key.path == "lines/stations/retry_writes")
        return Sides::has(sides.after, map + "/retries", "0");
    if (key.path == "lines/retries" || key.path == "lines/stations/retries")
        return !Sides::has(sides.after, map + "/retry_writes", "true");
    return key.path == "lines/stations/profile" && !Sides::has(sides.after, map + "/guard", "true");
}

/// A station that was protected is not listed any more, on a line that passes such stations.
bool is_unprotected(const Change& change, const Sides& sides) {
    const std::string line = change.path.substr(0, change.path.find("/stations/"));
    const bool passes = Sides::has(sides.after, line + "/unlisted_stations", "pass") &&
                        !Sides::has(sides.after, line + "/mode", "listen");
    return passes && (Sides::has(sides.before, change.path + "/access", "read_only") ||
                      Sides::has(sides.before, change.path + "/guard", "true"));
}

/// `setting`: of one of the sides.
bool is_weaker(const Change& change, const Setting& setting, const Sides& sides) {
    const config::KeyShape* key = config::describe().of(setting);
    if (setting.secret) return !change.path.ends_with("/files");
    if (key == nullptr) return false;
    if (key->path == "lines/stations")
        return change.kind == Kind::removed
                   ? is_unprotected(change, sides)
                   : Sides::has(sides.after, change.path + "/retry_writes", "true");
    if (key->path == "access/rules") {
        const bool was_added = change.kind == Kind::added;
        const Settings& side = was_added ? sides.after : sides.before;
        return !Sides::has(side, change.path + (was_added ? "/allow" : "/deny"), "");
    }
    // Only the alias of unit 0 keeps broadcasts from all stations.
    if (key->path.ends_with("/units") && change.kind == Kind::removed)
        return change.path.ends_with("/units/0") &&
               !Sides::has(sides.after,
                           change.path.substr(0, change.path.find("/units/")) + "/broadcast",
                           "deny");
    return weakens(key->weaker, change) && !is_harmless(change, *key, sides);
}

Change change_of(const std::string& path, const Difference& difference) {
    Change change{path, Kind::changed, "", ""};
    if (difference.before == nullptr) change.kind = Kind::added;
    if (difference.after == nullptr) change.kind = Kind::removed;
    const auto shown = [](const Setting* setting) {
        return setting == nullptr || setting->secret || !setting->applies ? "" : setting->value;
    };
    change.before = shown(difference.before);
    change.after = shown(difference.after);
    return change;
}

void add_profiles(const config::Config& before, const config::Config& after,
                  std::vector<Change>& changes) {
    const auto add = [&](const std::string& name, Kind kind) {
        changes.push_back({"profiles/" + name, kind, "", ""});
    };
    for (const auto& [name, profile] : before.profiles->all()) {
        const profile::PanelProfile* other = after.profiles->find(name);
        if (other == nullptr) {
            add(name, Kind::removed);
        } else if (*other != profile) {
            add(name, Kind::changed);
        }
    }
    for (const auto& [name, profile] : after.profiles->all()) {
        if (before.profiles->find(name) == nullptr) add(name, Kind::added);
    }
}

template <class T>
const T* named(const std::vector<T>& all, std::string_view name) {
    const auto found = std::ranges::find(all, name, &T::name);
    return found == all.end() ? nullptr : &*found;
}

/// By the names that they have in Setting::path.
std::map<std::string, const tcp_server::Settings*> listeners_of(const config::Config& config) {
    std::map<std::string, const tcp_server::Settings*> all;
    Distinct names;
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        all.emplace(names.name(listener.name()), &listener);
    return all;
}

bool is_reopened(const config::Line& before, const config::Config& after) {
    const config::Line* now = named(after.lines, before.name);
    return now != nullptr && !is_same_wire(before, *now, false);
}

/// True for a setting of a line that stays open, such as `simulate` of a real one.
bool is_taken_over(const config::Config& before, const config::Config& after,
                   std::string_view path) {
    constexpr std::string_view kLines = "lines/";
    if (!path.starts_with(kLines)) return false;
    path.remove_prefix(kLines.size());
    const config::Line* line = named(before.lines, path.substr(0, path.find('/')));
    return line != nullptr && !is_reopened(*line, after);
}

constexpr std::string_view kPortCloses = "the port is closed";
constexpr std::string_view kClientsClose = "its clients are closed";

/// True if clients that were let in may be outside now.
bool may_close(const std::vector<Network>& before, const std::vector<Network>& after) {
    static const std::vector<Network> kAll{{"0.0.0.0", 0}, {"::", 0}};
    const auto is_inside = [&](const Network& network) {
        return std::ranges::any_of(
            after, [&](const Network& wide) { return config::covers(wide, network); });
    };
    return !after.empty() && !std::ranges::all_of(before.empty() ? kAll : before, is_inside);
}

/// Who is let in by certificate, and as whom. What the files hold is not the file's text.
bool has_other_rules(const std::optional<tls::Settings>& before,
                     const std::optional<tls::Settings>& after) {
    const auto rules = [](const tls::Settings& of) {
        return std::tie(of.ca, of.crl, of.client, of.role_from_certificate, of.lowest);
    };
    return before && after && rules(*before) != rules(*after);
}

/// What happens to the clients of a listener; `after` is null where it is gone.
template <class Settings>
std::string_view cut_of(const Settings& before, const Settings* after) {
    if (after == nullptr) return kClientsClose;
    if (!before.is_same_listener(*after)) return config::kListensAnew;
    if (may_close(before.allow, after->allow)) return config::kAllowCloses;
    return has_other_rules(before.tls, after->tls) ? config::kTlsCloses : std::string_view();
}

std::string_view cut_of(const config::Line& before, const config::Config& after) {
    if (named(after.lines, before.name) == nullptr) return kPortCloses;
    return is_reopened(before, after) ? config::kOpensPort : std::string_view();
}

std::string_view cut_of(const serial_server::Settings& before, const config::Config& after) {
    const auto* now = named(after.serial_masters, before.name);
    if (now == nullptr) return kPortCloses;
    return before.is_same_port(*now) ? std::string_view() : config::kOpensPort;
}

std::string_view cut_of_session(const config::Config& before, const config::Config& after) {
    if (!before.mqtt || is_same_session(before, after)) return {};
    return after.mqtt ? config::kConnectsAnew : "the session ends";
}

}  // namespace

std::vector<Interruption> interruptions(const config::Config& before, const config::Config& after) {
    std::vector<Interruption> all;
    const auto add = [&](const std::string& path, std::string_view what) {
        if (!what.empty()) all.push_back({path, std::string(what)});
    };
    for (const config::Line& line : before.lines) add("lines/" + line.name, cut_of(line, after));
    for (const serial_server::Settings& master : before.serial_masters)
        add("serial_masters/" + master.name, cut_of(master, after));
    const auto listeners = listeners_of(after);
    for (const auto& [name, listener] : listeners_of(before)) {
        const auto now = listeners.find(name);
        add("modbus_tcp/" + name,
            cut_of(*listener, now == listeners.end() ? nullptr : now->second));
    }
    if (before.http) add("http", cut_of(*before.http, after.http ? &*after.http : nullptr));
    add("mqtt", cut_of_session(before, after));
    return all;
}

std::string_view label(Kind kind) {
    constexpr std::array<std::string_view, 3> kWords{"added", "removed", "changed"};
    return kWords[static_cast<std::size_t>(kind)];
}

namespace {

/// The names of the rules of `access` that both have, in the order in which they are asked.
std::string order_of_rules(const config::Config& config, const config::Config& other) {
    std::string order;
    for (const access::Rule& rule : config.access.rules) {
        if (std::ranges::find(other.access.rules, rule.name, &access::Rule::name) !=
            other.access.rules.end())
            order += (order.empty() ? "" : ", ") + rule.name;
    }
    return order;
}

}  // namespace

std::vector<Change> differences(const config::Config& before, const config::Config& after) {
    const Settings old_settings = by_path(before);
    const Settings new_settings = by_path(after);
    const Differences all = compare(old_settings, new_settings);
    std::vector<Change> changes;
    const config::Described& keys = config::describe();
    for (const auto& [path, difference] : all) {
        if (is_within(all, path) || follows(all, difference)) continue;
        changes.push_back(change_of(path, difference));
        changes.back().weaker = is_weaker(
            changes.back(), difference.after == nullptr ? *difference.before : *difference.after,
            {old_settings, new_settings});
        if (is_one_sided(difference)) continue;
        const config::KeyShape* key = keys.of(*difference.after);
        if (key != nullptr && !is_taken_over(before, after, path))
            changes.back().needs = key->change;
    }
    add_profiles(before, after, changes);
    // Settings have names, not places.
    if (order_of_rules(before, after) != order_of_rules(after, before))
        changes.push_back({"access/rules", Kind::changed, order_of_rules(before, after),
                           order_of_rules(after, before), "", true});
    std::ranges::sort(changes, {}, &Change::path);
    return changes;
}

std::vector<std::string> weaker(const config::Config& before, const config::Config& after) {
    std::vector<std::string> all;
    for (const Change& change : differences(before, after))
        if (change.weaker) all.push_back(to_string(change));
    return all;
}

std::string to_string(const Change& change) {
    const std::string word(label(change.kind));
    if (change.before.empty() && change.after.empty() && change.kind != Kind::changed)
        return change.path + ": " + word;
    const std::size_t cut = change.path.rfind('/');
    const std::string place = cut == change.path.npos
                                  ? change.path + ':'
                                  : change.path.substr(0, cut) + ": " + change.path.substr(cut + 1);
    if (change.kind == Kind::added) return place + " added, " + change.after;
    if (change.kind == Kind::removed) return place + " removed, was " + change.before;
    if (change.before.empty() && change.after.empty()) return place + ' ' + word;
    const auto shown = [](const std::string& value) { return value.empty() ? "not set" : value; };
    return place + ' ' + shown(change.before) + " -> " + shown(change.after);
}

boost::json::array to_json(const std::vector<Change>& changes) {
    boost::json::array made;
    for (const Change& change : changes) {
        boost::json::object one{{"path", change.path}, {"kind", label(change.kind)}};
        if (!change.before.empty()) one["before"] = change.before;
        if (!change.after.empty()) one["after"] = change.after;
        if (!change.needs.empty()) one["needs"] = change.needs;
        made.push_back(std::move(one));
    }
    return made;
}

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
    const bool both_listed = was.station != nullptr && is.station != nullptr;
    if (both_listed && was.station->name == is.station->name) return true;
    if (was.id != is.id || !is_same_line(was.line, is.line)) return false;
    const bool went = was.station != nullptr && after.stations.contains(was.station->name);
    const bool came = is.station != nullptr && before.stations.contains(is.station->name);
    return !went && !came;
}

std::string destination_text(const Destination& place) {
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
    if (is.station == nullptr && is.id == unit)
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
