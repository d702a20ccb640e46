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

/// One setting of a configuration, or a named entry that has settings.
struct Setting {
    /// The keys of the file, list entries by their names, joined by '/':
    /// "lines/floor1/stations/press/guard".
    std::string path;
    std::string value;    ///< as written in the file; "" for an entry that only has settings
    bool secret = false;  ///< never shown
    /// The path of the setting that this one inherits from if it is not given itself, or "".
    std::string otherwise = {};
};

/// All settings of a configuration, with the defaults filled in: every difference between two files
/// that mean different things shows here, except for the contents of profiles.
std::vector<Setting> all_settings(const config::Config& config);

/// Appends settings below a path to a list, which it does not own.
class SettingWriter {
  public:
    SettingWriter(std::vector<Setting>& settings, std::string path)
        : settings_(&settings), path_(std::move(path)) {}

    void put(std::string_view key, std::string value) { add(key, std::move(value), ""); }
    void put(std::string_view key, std::string_view value) { add(key, std::string(value), ""); }
    void put(std::string_view key, const char* value) { add(key, value, ""); }
    void put(std::string_view key, bool value) { add(key, value ? "true" : "false", ""); }
    void put(std::string_view key, Duration value);
    void put(std::string_view key, std::size_t value) { add(key, std::to_string(value), ""); }
    void put(std::string_view key, int value) { add(key, std::to_string(value), ""); }
    /// Inherited from the same key of `owner` unless given itself.
    void put(std::string_view key, std::string value, const SettingWriter& owner) {
        add(key, std::move(value), owner.at(key));
    }
    void put_secret(std::string_view key, std::string value);

    /// A writer for a map of keys; the map itself is no setting.
    SettingWriter below(std::string_view key) const { return {*settings_, at(key)}; }
    /// A writer for an entry that may exist or not, such as one of a list; adds the entry itself.
    SettingWriter item(std::string_view key) const;
    SettingWriter item(std::string_view list, std::string_view name) const {
        return below(list).item(name);
    }

  private:
    std::string at(std::string_view key) const {
        return path_.empty() ? std::string(key) : path_ + '/' + std::string(key);
    }
    void add(std::string_view key, std::string value, std::string otherwise) {
        settings_->push_back({at(key), std::move(value), false, std::move(otherwise)});
    }

    std::vector<Setting>* settings_;
    std::string path_;
};

/// Unique names for entries without a name of their own: the second one is "NAME (2)".
class Distinct {
  public:
    std::string name(const std::string& known_by);

  private:
    std::map<std::string, int> seen_;
};

/// The parts of all_settings().
void add_settings_of_line(const SettingWriter& top, const config::Line& line);
void add_settings_of_port(SettingWriter& port, const line::Settings& settings);
void add_settings_of_servers(const SettingWriter& top, const config::Config& config);

}  // namespace panelgate::app
