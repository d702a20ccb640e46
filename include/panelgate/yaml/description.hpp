#pragma once

#include <cstdint>
#include <map>
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
    /// What is behind a key of `map`: a map, or a list of maps.
    void tell_below(const Node& map, std::string_view key, const Node& value);

    /// In the order in which they were asked for.
    const std::vector<KeyShape>& keys() const { return keys_; }

  private:
    /// nullptr: nothing is written down of this map.
    const std::string* path_of(const Node& map) const;

    std::vector<KeyShape> keys_;
    std::map<const Node*, std::string> paths_;
};

}  // namespace panelgate::yaml
