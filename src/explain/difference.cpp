#include "panelgate/explain/difference.hpp"

#include <algorithm>
#include <array>
#include <boost/json/object.hpp>
#include <charconv>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "panelgate/base/role.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/explain/translations.hpp"
#include "panelgate/tls/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "setting_tree.hpp"

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

/// True if the second list has an item that no item of the first one covers.
template <class Covers>
bool has_more(const std::string& before, const std::string& after, const Covers& covers) {
    if (before.empty() || after.empty()) return after.empty();
    const auto known = list_items(before);
    return std::ranges::any_of(list_items(after), [&](const std::string& item) {
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
        case By::role:  // is_weaker() knows the roles
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
        case By::granted:
            return !change.after.empty() &&
                   (change.before.empty() ||
                    has_more(change.before, change.after, std::equal_to<>()));
        case By::wider:
            return has_more(change.before, change.after, covers_network);
    }
    std::abort();
}

/// The settings of both sides, for rules of two keys.
struct Sides {
    const Settings& before;
    const Settings& after;
    std::span<const OwnRole> roles_before;
    std::span<const OwnRole> roles_after;

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

/// The path of the station that has this id on a line; "" if none has it.
std::string station_with(const std::string& id, const std::string& line, const Settings& side) {
    const std::string stations = line + "/stations/";
    for (auto at = side.lower_bound(stations); at != side.end(); ++at) {
        const std::string& path = at->first;
        if (!path.starts_with(stations)) break;
        const std::size_t end = path.find('/', stations.size());
        if (end != path.npos && path.substr(end) == "/id" && at->second.value == id)
            return path.substr(0, end);
    }
    return {};
}

/// A protected station has another name now, and is protected no more. A station that only goes is
/// what it was before somebody added it.
bool is_unprotected(const Change& change, const Sides& sides) {
    const auto id = sides.before.find(change.path + "/id");
    if (id == sides.before.end()) return false;
    const std::string line = change.path.substr(0, change.path.find("/stations/"));
    const std::string now = station_with(id->second.value, line, sides.after);
    const auto loses = [&](const std::string& key, std::string_view value) {
        return Sides::has(sides.before, change.path + key, value) &&
               !Sides::has(sides.after, now + key, value);
    };
    return !now.empty() && (loses("/access", "read_only") || loses("/guard", "true"));
}

/// `setting`: of one of the sides.
bool is_weaker(const Change& change, const Setting& setting, const Sides& sides) {
    const config::KeyShape* key = config::describe().of(setting);
    if (setting.secret) return setting.lets_in;
    if (key == nullptr) return false;
    if (key->path == "mqtt")
        return change.kind == Kind::added && Sides::has(sides.after, "mqtt/write", "points");
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
    if (key->weaker.by == By::role)
        return standing_named(change.after, sides.roles_after)
            .exceeds(standing_named(change.before, sides.roles_before));
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
        return std::tie(of.crl, of.client, of.role_from_certificate);
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

std::map<std::string, const tcp_server::Settings*> listeners_of(const config::Config& config) {
    std::map<std::string, const tcp_server::Settings*> all;
    Distinct names;
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        all.emplace(names.name(listener.name()), &listener);
    return all;
}

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
            {old_settings, new_settings, before.access.roles, after.access.roles});
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

boost::json::array to_json(const std::vector<Interruption>& interruptions) {
    boost::json::array made;
    for (const Interruption& cut : interruptions)
        made.push_back(boost::json::object{{"path", cut.path}, {"what", cut.what}});
    return made;
}

}  // namespace panelgate::explain
