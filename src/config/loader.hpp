#pragma once

#include <set>
#include <string>
#include <string_view>

#include "panelgate/config/config.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// What the parts of the loader share while one file is read.
struct Loading {
    const Files& files;
    yaml::Problems& problems;
    Config& config;
    std::set<std::string> station_names;

    void warn(yaml::Mark mark, const std::string& message) {
        config.warnings.push_back(yaml::format({problems.file(), mark, "warning: " + message}));
    }
};

/// Line and station names: [a-z0-9-]+.
bool is_name(std::string_view text);

void load_lines(Loading& loading, yaml::MapReader& root);
void load_modbus_tcp(Loading& loading, yaml::MapReader& root);
void load_http(Loading& loading, yaml::MapReader& root);

}  // namespace panelgate::config
