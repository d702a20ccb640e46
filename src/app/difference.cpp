#include "difference.hpp"

#include <algorithm>
#include <array>
#include <boost/json/object.hpp>
#include <map>
#include <utility>

#include "setting.hpp"

namespace panelgate::app {
namespace {

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
    for (Setting& setting : all_settings(config)) {
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

/// True if it changes only because the setting that it inherits from changes.
bool follows(const Differences& all, const Difference& difference) {
    if (is_one_sided(difference) || difference.after->otherwise.empty()) return false;
    const auto owner = all.find(difference.after->otherwise);
    if (owner == all.end() || &owner->second == &difference || is_one_sided(owner->second))
        return false;
    return owner->second.before->value == difference.before->value &&
           owner->second.after->value == difference.after->value;
}

Change change_of(const std::string& path, const Difference& difference) {
    Change change{path, Kind::changed, "", ""};
    if (difference.before == nullptr) change.kind = Kind::added;
    if (difference.after == nullptr) change.kind = Kind::removed;
    const auto shown = [](const Setting* setting) {
        return setting == nullptr || setting->secret ? "" : setting->value;
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

}  // namespace

std::string_view label(Kind kind) {
    constexpr std::array<std::string_view, 3> kWords{"added", "removed", "changed"};
    return kWords[static_cast<std::size_t>(kind)];
}

std::vector<Change> differences(const config::Config& before, const config::Config& after) {
    const Settings old_settings = by_path(before);
    const Settings new_settings = by_path(after);
    const Differences all = compare(old_settings, new_settings);
    std::vector<Change> changes;
    for (const auto& [path, difference] : all) {
        if (is_within(all, path) || follows(all, difference)) continue;
        changes.push_back(change_of(path, difference));
    }
    add_profiles(before, after, changes);
    std::ranges::sort(changes, {}, &Change::path);
    return changes;
}

std::string to_string(const Change& change) {
    const std::string word(label(change.kind));
    if (change.before.empty() && change.after.empty() && change.kind != Kind::changed)
        return change.path + ": " + word;
    const std::size_t cut = change.path.rfind('/');
    if (cut == change.path.npos) return change.path + ": " + word;
    const std::string place = change.path.substr(0, cut) + ": " + change.path.substr(cut + 1);
    if (change.kind == Kind::added) return place + " added, " + change.after;
    if (change.kind == Kind::removed) return place + " removed, was " + change.before;
    if (change.before.empty() && change.after.empty()) return place + ' ' + word;
    return place + ' ' + change.before + " -> " + change.after;
}

boost::json::array to_json(const std::vector<Change>& changes) {
    boost::json::array made;
    for (const Change& change : changes) {
        boost::json::object one{{"path", change.path}, {"kind", label(change.kind)}};
        if (!change.before.empty()) one["before"] = change.before;
        if (!change.after.empty()) one["after"] = change.after;
        made.push_back(std::move(one));
    }
    return made;
}

}  // namespace panelgate::app
