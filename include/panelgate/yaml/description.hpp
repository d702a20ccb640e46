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

/// What a key takes.
struct KeyShape {
    enum class Kind : std::uint8_t { text, integer, number, boolean, duration, word, map, list };
    std::string path;  ///< the keys from the top, places in lists left out: "lines/stations/id"
    Kind kind = Kind::text;
    bool required = false;
    std::vector<std::string> words;  ///< of Kind::word; of others, those that they take besides
    std::int64_t min = 0;            ///< of Kind::integer
    std::int64_t max = 0;
    Duration shortest{};  ///< of Kind::duration
    Duration longest{};
    std::optional<double> least;  ///< of Kind::number
    std::optional<double> most;
    std::optional<double> never;

    /// Nothing behind the key; without a word maps and lists may have that, as if they were absent.
    std::optional<bool> may_be_null;
    std::size_t fewest = 0;        ///< entries of a list or map
    std::size_t most_entries = 0;  ///< 0: no limit
    /// A regular expression (ECMA 262) that has to match a text, or those in a list or map; ""
    /// none.
    std::string pattern;
    std::size_t longest_text = 0;  ///< characters; 0: no limit
    bool may_be_number = true;     ///< such a text, for YAML
    bool holds_integers = false;   ///< a list of raw numbers
    std::string keys;              ///< the same of the keys of a map that has no words for them
};

/// What one key of a map wants of another; a merge may bring the other.
struct KeyRule {
    std::string map;  ///< its path
    std::string key;
    std::string other;
    /// With `needs`: where `key` has one of them, `other` is there. Else `key` is only there where
    /// `other` has one of them, or is absent and `absent_will_do`.
    std::vector<std::string> words;
    bool needs = false;
    bool absent_will_do = false;
};

/// What a loader asks for, written down while it reads a document: MapReaders whose Problems have
/// one tell it each key, whether it is there or not. So it knows the keys of each map that the
/// document has.
class Description {
  public:
    /// The whole document, whose keys have no path before them. Until forget(), nodes may not move.
    void begin(const Node& top) { paths_[&top] = ""; }
    void forget() { paths_.clear(); }
    /// A key of `map`, with the path left out. What was told of a key before is kept: required, and
    /// words, which say more than that it is a text.
    void tell(const Node& map, std::string_view key, KeyShape shape);
    /// To be written into at once; nullptr: nothing is written down of this map.
    KeyShape* shape(const Node& map, std::string_view key);
    /// The path of the map is added.
    void tell_rule(const Node& map, KeyRule rule);
    /// What is behind a key of `map`: a map, or a list of maps.
    void tell_below(const Node& map, std::string_view key, const Node& value);

    /// In the order in which they were asked for.
    const std::vector<KeyShape>& keys() const { return keys_; }
    const std::vector<KeyRule>& rules() const { return rules_; }

  private:
    /// nullptr: nothing is written down of this map.
    const std::string* path_of(const Node& map) const;

    std::vector<KeyShape> keys_;
    std::vector<KeyRule> rules_;
    std::map<const Node*, std::string> paths_;
};

}  // namespace panelgate::yaml
