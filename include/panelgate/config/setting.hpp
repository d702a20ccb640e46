#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// A map of settings, or an entry of a list: where its settings belong in the file.
struct SettingMap {
    std::string path;                         ///< as Setting::path
    std::string keys;                         ///< KeyShape::path of the map, or of the list
    std::shared_ptr<const SettingMap> above;  ///< null: the whole file
    bool in_list = false;                     ///< an entry of the list `keys`
};

/// One setting of a configuration, or a named entry that has settings.
struct Setting {
    /// The keys of the file, list entries by their names, joined by '/':
    /// "lines/floor1/stations/press/guard".
    std::string path;
    std::string value;    ///< as written in the file; "": not set, or an entry that has settings
    bool secret = false;  ///< never shown
    /// Path of the setting whose value a missing key inherits, or "".
    std::string otherwise = {};
    /// False: a file cannot have it beside the value of a neighbour; it has its default then.
    bool applies = true;
    std::shared_ptr<const SettingMap> map = {};  ///< that it is in; of an entry, the entry itself
    std::optional<std::string_view> initial =
        {};                ///< KeyShape::initial; nothing of what has no row
    bool lets_in = false;  ///< a secret that decides who is let in

    bool is_entry() const { return path == map->path; }
    /// The last part of its path; "" of an entry.
    std::string_view key() const {
        if (is_entry()) return {};
        return std::string_view(path).substr(map->path.empty() ? 0 : map->path.size() + 1);
    }
};

/// All settings of a configuration, with the defaults filled in: every difference between two files
/// that mean different things shows here, except for the contents of profiles.
std::vector<Setting> all_settings(const Config& config);
/// The same in parts, a line each, so that a large file's are never there together. The first part
/// has the keys of the whole file.
void each_part(const Config& config, const std::function<void(std::vector<Setting>)>& take);

/// Unique names for entries without a name of their own: the second one is "NAME (2)".
class Distinct {
  public:
    std::string name(const std::string& known_by);

  private:
    std::map<std::string, int> seen_;
};

}  // namespace panelgate::config
