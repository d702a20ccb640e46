#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::app {

/// One setting of a configuration, or something named that has settings.
struct Held {
    /// The keys of the file, lists by the names of what they hold, joined by '/':
    /// "lines/floor1/stations/press/guard".
    std::string path;
    std::string value;    ///< as the file writes it; "" of what only has settings
    bool secret = false;  ///< never shown
    /// The path of the setting that this one has when it says nothing itself, or "".
    std::string otherwise = {};
};

/// All that a configuration holds, with the defaults filled in: whatever may differ between two
/// files that mean different things is here. What a profile brings is in the profile.
std::vector<Held> all_held(const config::Config& config);

/// Where settings are told: a path, and the list that they go to. Does not own the list.
class Holder {
  public:
    Holder(std::vector<Held>& held, std::string path) : held_(&held), path_(std::move(path)) {}

    void tell(std::string_view key, std::string value) { add(key, std::move(value), ""); }
    void tell(std::string_view key, std::string_view value) { add(key, std::string(value), ""); }
    void tell(std::string_view key, const char* value) { add(key, value, ""); }
    void tell(std::string_view key, bool value) { add(key, value ? "true" : "false", ""); }
    void tell(std::string_view key, Duration value);
    void tell(std::string_view key, std::size_t value) { add(key, std::to_string(value), ""); }
    void tell(std::string_view key, int value) { add(key, std::to_string(value), ""); }
    /// As what `owner` has under the same key, unless it says so itself.
    void tell(std::string_view key, std::string value, const Holder& owner) {
        add(key, std::move(value), owner.at(key));
    }
    void tell_secret(std::string_view key, std::string value);

    /// A map of keys: a path, and nothing that could be added or removed.
    Holder below(std::string_view key) const { return {*held_, at(key)}; }
    /// Something that may be there or not, such as one of a list: told as there.
    Holder item(std::string_view key) const;
    Holder item(std::string_view list, std::string_view name) const {
        return below(list).item(name);
    }

  private:
    std::string at(std::string_view key) const {
        return path_.empty() ? std::string(key) : path_ + '/' + std::string(key);
    }
    void add(std::string_view key, std::string value, std::string otherwise) {
        held_->push_back({at(key), std::move(value), false, std::move(otherwise)});
    }

    std::vector<Held>* held_;
    std::string path_;
};

/// What has no name of its own, by what it is known by: the second of those is "NAME (2)".
class Distinct {
  public:
    std::string name(const std::string& known_by);

  private:
    std::map<std::string, int> seen_;
};

/// The parts of all_held().
void hold_line(const Holder& top, const config::Line& line);
void hold_port(Holder& port, const line::Settings& settings);
void hold_servers(const Holder& top, const config::Config& config);

}  // namespace panelgate::app
