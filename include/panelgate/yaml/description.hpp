#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate::yaml {

struct Node;

/// What values a key accepts.
struct KeyShape {
    enum class Kind : std::uint8_t { text, integer, number, boolean, duration, word, map, list };
    std::string path;  ///< keys from the top, without list indexes: "lines/stations/id"
    Kind kind = Kind::text;
    bool required = false;
    std::vector<std::string> words;  ///< of Kind::word; for other kinds, words accepted besides
    std::int64_t min = 0;            ///< of Kind::integer, and of holds_integers unless both are 0
    std::int64_t max = 0;
    Duration shortest{};  ///< of Kind::duration
    Duration longest{};
    std::optional<double> least;  ///< of Kind::number
    std::optional<double> most;
    std::optional<double> never;

    /// Whether the key may have no value; if not set, maps and lists may, as if they were absent.
    std::optional<bool> may_be_null;
    std::size_t fewest = 0;        ///< entries of a list or map
    std::size_t most_entries = 0;  ///< 0: no limit
    /// Regular expression (ECMA 262) that a text, or those in a list or map, must match; "" none.
    std::string pattern;
    std::size_t longest_text = 0;  ///< characters; 0: no limit
    bool may_be_number = true;     ///< the text may look like a number to YAML
    bool holds_integers = false;   ///< a list of raw numbers
    std::string keys;              ///< pattern for the keys of a map with free keys
    std::string text;              ///< what it is for; one sentence
    std::string initial;           ///< what leaving it out means, in the file's notation; or ""
    std::string example;           ///< a value in the file's notation; or ""
    std::string change;            ///< what a change of it needs beside a reload; or ""
    int order = 0;                 ///< among the keys of its map
    bool may_be_text = false;      ///< of Kind::map: a text says the same
};

/// A dependency between two keys of a map; a merge may supply the other.
struct KeyRule {
    std::string map;  ///< its path
    std::string key;
    std::string other;
    /// With `needs`: if `key` has one of them, `other` must be present. Otherwise `key` may be
    /// present only if `other` has one of them, or is absent and `absent_will_do`.
    std::vector<std::string> words;
    bool needs = false;
    bool absent_will_do = false;
};

/// Records the keys that a loader asks for while it reads a document: each MapReader whose Problems
/// have a Description reports every key, present or not, for each map in the document.
class Description {
  public:
    /// Starts with the whole document, whose keys have no path before them. Nodes must not move
    /// until forget().
    void begin(const Node& top) { paths_[&top] = ""; }
    void forget() { paths_.clear(); }
    /// Records a key of `map`; `shape` has no path. Keeps what is known already: required, and
    /// words, which are more specific than a text.
    void tell(const Node& map, std::string_view key, KeyShape shape);
    /// Returns the entry of a key, to be modified at once; nullptr if this map is not recorded.
    KeyShape* shape(const Node& map, std::string_view key);
    /// Adds a rule, with the path of the map.
    void add_rule(const Node& map, KeyRule rule);
    /// Registers the value of a key of `map`: a map, or a list of maps.
    void add_nested(const Node& map, std::string_view key, const Node& value);

    /// In the order in which they were asked for.
    const std::vector<KeyShape>& keys() const { return keys_; }
    const std::vector<KeyRule>& rules() const { return rules_; }

  private:
    /// nullptr if this map is not recorded.
    const std::string* path_of(const Node& map) const;

    std::vector<KeyShape> keys_;
    std::vector<KeyRule> rules_;
    std::map<const Node*, std::string> paths_;
};

}  // namespace panelgate::yaml
