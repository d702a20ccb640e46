#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>
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
struct LineContext;

/// Where what may be there once was written first.
class Firsts {
  public:
    /// Returns "; the first one is in line 5" for a repeated name, else "".
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
    std::set<std::string> station_names{};
    /// `lines`, or a line's `stations`, was no list: names that are not known may be right.
    bool names_missing = false;
    Firsts firsts{};                          ///< "line floor1", "device /dev/ttyS1"
    std::vector<yaml::Elsewhere> top_keys{};  ///< of the file, for maps that may end unnoticed
    LineContext* line = nullptr;              ///< that is being read
    const Station* station = nullptr;         ///< that is being read
    Firsts points{};                          ///< of that station
    bool is_template = false;  ///< the body of a template is read as a station: it has no id

    /// The file that a text of the configuration names.
    std::string path_of(const std::string& typed) const { return beside(problems.file(), typed); }

    /// Returns the content of a regular file; nothing for unreadable files, and for devices and
    /// pipes, whose content may never end.
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

/// A map of the file while its rows are read.
class Reader : public yaml::MapReader {
  public:
    Reader(Loading& shared, const yaml::Node& node, std::string what, std::string_view example = {})
        : MapReader(node, shared.problems, std::move(what), example), loading(shared) {}

    void warn(std::string_view key, const std::string& message) {
        loading.warn(mark(key), message);
    }

    Loading& loading;
    bool top = false;  ///< the map is the whole file
};

/// Returns nullptr if there is none.
const Line* find_line(const Config& config, std::string_view name);

/// Line and station names: [a-z0-9-]+.
bool is_name(std::string_view text);
/// Returns a regular expression for texts of these letters; a '-' must be the last of them.
std::string pattern_of(std::string_view letters);
/// Returns what is wrong with a name; "" if nothing is.
std::string name_fault(std::string_view typed);
/// Returns "; write big-press" for "Big Press"; "" if no letter is usable.
std::string name_hint(std::string_view typed);
/// Reports the second "rule 'a'", at its name.
void check_unique(Reader& in, const std::string& what, const std::string& name);

}  // namespace panelgate::config
