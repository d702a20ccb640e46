#pragma once

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/config/config.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// What the parts of the loader share while one file is read.
struct Loading {
    const Files& files;
    yaml::Problems& problems;
    Config& config;
    std::set<std::string> station_names;

    void warn(yaml::Mark mark, const std::string& message) {
        std::string text = yaml::format({problems.file(), mark, "warning: " + message});
        // Many stations may have it from one template.
        if (std::ranges::find(config.warnings, text) == config.warnings.end())
            config.warnings.push_back(std::move(text));
    }
};

/// Line and station names: [a-z0-9-]+.
bool is_name(std::string_view text);
/// A regular expression of texts of these letters, a '-' among them the last.
std::string pattern_of(std::string_view letters);
/// The key `name`; nothing when it is absent or not a name (then a problem). `pattern`: what the
/// schema says of it.
std::optional<std::string> load_name(yaml::MapReader& in, bool required,
                                     const std::string& pattern = name_pattern());
/// "; write big-press" for "Big Press"; "" when nothing of it is left.
std::string name_hint(std::string_view typed);
/// The key `access`: true for read_only.
std::optional<bool> load_read_only(yaml::MapReader& in);
/// "; did you mean 'x'?" when one of `known` is near, else "; known NOUN are a, b, c".
std::string did_you_mean(std::string_view typed, std::span<const std::string_view> known,
                         std::string_view noun);

/// A key with nothing behind it, or with all of it commented out, says neither "all" nor "none": a
/// problem that ends with `instead`. Call it when all keys have been read.
void refuse_empty(yaml::MapReader& in, std::string_view key, std::string_view instead);

/// Without lines it tells so, but where a key is likely to be meant as `lines`: then
/// refuse_no_lines() has to be called when finish() found nothing wrong with that key.
void load_lines(Loading& loading, yaml::MapReader& root);
void refuse_no_lines(Loading& loading, yaml::MapReader& root);
void load_relays(Loading& loading, yaml::MapReader& root);
void load_modbus_tcp(Loading& loading, yaml::MapReader& root);
void load_serial_masters(Loading& loading, yaml::MapReader& root);
void load_http(Loading& loading, yaml::MapReader& root);
void load_mqtt(Loading& loading, yaml::MapReader& root);

}  // namespace panelgate::config
