#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

using yaml::did_you_mean;

/// Where what may be there once was written first.
class Firsts {
  public:
    /// "; the first one is in line 5" where it has been there before, else "".
    std::string again(const std::string& name, yaml::Mark mark) {
        const auto [first, added] = lines_.emplace(name, mark.line);
        return added ? "" : "; the first one is in line " + std::to_string(first->second);
    }
    /// Reports at `key` what has been there before.
    void once(yaml::MapReader& in, std::string_view key, const std::string& name,
              const std::string& message) {
        const std::string first = again(name, in.mark(key));
        if (!first.empty()) in.problem(key, message + first);
    }

  private:
    std::map<std::string, int> lines_;
};

/// What the parts of the loader share while one file is read.
struct Loading {
    const Files& files;
    yaml::Problems& problems;
    Config& config;
    std::set<std::string> station_names;
    /// `lines`, or a line's `stations`, was no list: names that are not known may be right.
    bool names_missing = false;
    Firsts firsts{};                          ///< "line floor1", "device /dev/ttyS1"
    std::vector<yaml::Elsewhere> top_keys{};  ///< of the file, for maps that may end unnoticed

    /// The file that a text of the configuration names.
    std::string path_of(const std::string& typed) const { return beside(problems.file(), typed); }

    /// The content of a regular file; nothing if it cannot be read. Another one might never end.
    std::optional<std::string> content_of(const std::string& path) const {
        return files.is_special(path) ? std::nullopt : files.read(path);
    }

    void warn(yaml::Mark mark, const std::string& message) {
        std::string text = yaml::format({problems.file(), mark, "warning: " + message});
        // Many stations may have it from one template.
        if (std::ranges::find(config.warnings, text) == config.warnings.end())
            config.warnings.push_back(std::move(text));
    }
};

/// Reads the map `key`, if it is there, by `load`; its other keys are unknown.
template <class Load>
void load_map(yaml::MapReader& in, std::string_view key, std::string_view example,
              const Load& load) {
    const yaml::Node* node = in.map(key, example);
    if (node == nullptr) return;
    yaml::MapReader inside(*node, in.problems(), std::string(key));
    load(inside);
    inside.finish();
}

/// The same for a map at the top level: a key that belongs beside it is told so.
template <class Load>
void load_section(Loading& loading, yaml::MapReader& root, std::string_view key,
                  std::string_view example, const Load& load) {
    load_map(root, key, example, [&](yaml::MapReader& in) {
        in.elsewhere(loading.top_keys);
        load(in);
    });
}

/// Warns at `device` if `device` and `other`, the device of `owner`, are two names of one adapter:
/// only one owner can open an adapter (solax-modbus#1171).
void warn_of_same_adapter(Loading& loading, yaml::MapReader& in, const std::string& device,
                          const std::string& owner, const std::string& other);

/// Returns nullptr if there is none.
const Line* find_line(const Config& config, std::string_view name);

/// Line and station names: [a-z0-9-]+.
bool is_name(std::string_view text);
/// Returns a regular expression for texts of these letters; a '-' must be the last of them.
std::string pattern_of(std::string_view letters);
/// Reads the key `name`; nothing if it is absent or invalid (a problem). `pattern` is for the
/// schema.
std::optional<std::string> load_name(yaml::MapReader& in, bool required,
                                     const std::string& pattern = name_pattern());
/// Reads the same, required, and reports one that is there before: "there are two rules 'a'"; "" if
/// it is invalid.
std::string load_unique_name(Loading& loading, yaml::MapReader& in, const std::string& what);
/// Returns "; write big-press" for "Big Press"; "" if no letter is usable.
std::string name_hint(std::string_view typed);
/// Reads the key `access`: true for read_only.
std::optional<bool> load_read_only(yaml::MapReader& in);

/// Reports missing lines, unless a key is probably a mistyped `lines`: then call refuse_no_lines()
/// if finish() accepted that key.
void load_lines(Loading& loading, yaml::MapReader& root);
void refuse_no_lines(Loading& loading, yaml::MapReader& root);
void load_relays(Loading& loading, yaml::MapReader& root);
void load_modbus_tcp(Loading& loading, yaml::MapReader& root);
void load_serial_masters(Loading& loading, yaml::MapReader& root);
void load_http(Loading& loading, yaml::MapReader& root);
void load_mqtt(Loading& loading, yaml::MapReader& root);
void load_audit(Loading& loading, yaml::MapReader& root);
/// Needs lines, servers and masters loaded: rules name them.
void load_rules(Loading& loading, yaml::MapReader& root);
/// Gives each line its rules.
void apply_rules(Config& config);

}  // namespace panelgate::config
