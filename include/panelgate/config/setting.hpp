#pragma once

#include <map>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// One setting of a configuration, or a named entry that has settings.
struct Setting {
    /// The keys of the file, list entries by their names, joined by '/':
    /// "lines/floor1/stations/press/guard".
    std::string path;
    std::string value;    ///< as written in the file; "": not set, or an entry that has settings
    bool secret = false;  ///< never shown
    /// The path of the setting that this one inherits from if it is not given itself, or "".
    std::string otherwise = {};
    /// False: a file cannot have it beside the value of a neighbour; it has its default then.
    bool applies = true;
};

/// All settings of a configuration, with the defaults filled in: every difference between two files
/// that mean different things shows here, except for the contents of profiles.
std::vector<Setting> all_settings(const Config& config);

/// Unique names for entries without a name of their own: the second one is "NAME (2)".
class Distinct {
  public:
    std::string name(const std::string& known_by);

  private:
    std::map<std::string, int> seen_;
};

}  // namespace panelgate::config
