#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/describe.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// What a text must look like.
struct Form {
    std::string pattern = {};    ///< ECMA 262; "" any
    bool may_be_number = false;  ///< a text of the pattern may look like a number to YAML
    std::size_t longest = 0;     ///< characters; 0: no limit
    /// Returns what is wrong with a text; "" if nothing is.
    std::function<std::string(std::string_view typed)> fault = {};
};

/// What the items of a list must look like.
struct Items {
    std::string_view example;
    std::string_view any = {};  ///< what leaving the list out means; "": it may be empty
    std::string pattern = {};
    bool may_be_number = false;
    std::pair<std::int64_t, std::int64_t> integers = {};  ///< their range; {0, 0}: texts
    bool holds_integers = false;
};

class Table;

/// One key of a map, as far as no value of it is known.
struct Row {
    KeyShape shape;
    /// The rows of the map, or of each map of the list; empty: a value.
    std::function<const Table&()> below = {};
    bool inherits = false;  ///< missing keys below the map have the values of the owner's map
};

/// A dependency between two keys, and what is said where a file breaks it.
struct Condition {
    KeyRule rule;
    std::string why;
};

/// The rows of a map: what a visitor needs that reads no value.
class Table {
  public:
    const std::vector<Row>& rows() const { return rows_; }
    const std::vector<Condition>& conditions() const { return conditions_; }
    std::vector<std::string_view> names() const;

  protected:
    /// Reports the conditions that are not met.
    void check(yaml::MapReader& in) const;
    /// Marks settings of this map that a file cannot have beside the value of a neighbour.
    void mark_idle(std::span<Setting> shown) const;

    std::vector<Row> rows_;
    std::vector<Condition> conditions_;
};

KeyShape shape_of(std::string_view key, KeyShape::Kind kind, std::string_view text);
KeyShape integers(std::string_view key, std::int64_t min, std::int64_t max, std::string_view text);
KeyShape durations(std::string_view key, Duration min, Duration max, std::string_view text);
KeyShape words_shape(std::string_view key, std::span<const std::string_view> words,
                     std::string_view text);
KeyShape text_shape(std::string_view key, const Form& form, std::string_view text);
KeyShape items_shape(std::string_view key, const Items& items, std::string_view text);

}  // namespace panelgate::config
