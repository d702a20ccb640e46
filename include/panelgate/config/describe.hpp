#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate::config {

struct Setting;

/// Which change of a key lets more happen at the panels, or keeps less of what happened.
struct Weaker {
    enum class By : std::uint8_t {
        nothing,
        any,      ///< each change
        leaving,  ///< the value is `word` no more
        coming,   ///< the value becomes `word`
        growing,  ///< a number, or the place among `ranks`, grows; no value is the highest number
        falling,  ///< ... shrinks; no value is the lowest number
        more,     ///< a list has more words; an empty list means all
        granted,  ///< ... an empty list means none
        wider,    ///< networks that were not let in; an empty list means all
        role,     ///< the role of this name has a right that the one before had not
        added,    ///< an entry, or the map itself, is new
        removed   ///< ... is gone
    };
    By by = By::nothing;
    std::string word{};
    std::vector<std::string> ranks{};
};

/// What values a key accepts, and what its documentation says.
struct KeyShape {
    enum class Kind : std::uint8_t { text, integer, number, boolean, duration, word, map, list };
    /// Keys from the top, without list indexes: "lines/stations/id". In a row the key alone.
    std::string path;
    Kind kind = Kind::text;
    bool required = false;
    std::vector<std::string> words = {};  ///< of Kind::word; of other kinds, words besides
    std::int64_t min = 0;  ///< of Kind::integer, and of holds_integers unless both are 0
    std::int64_t max = 0;
    Duration shortest{};  ///< of Kind::duration
    Duration longest{};
    std::optional<double> least{};  ///< of Kind::number
    std::optional<double> most{};
    std::optional<double> never{};

    /// Whether the key may have no value; if not set, maps and lists may, as if they were absent.
    std::optional<bool> may_be_null{};
    std::size_t fewest = 0;        ///< entries of a list or map
    std::size_t most_entries = 0;  ///< 0: no limit
    /// Regular expression (ECMA 262) that a text, or those in a list or map, must match; "" none.
    std::string pattern = {};
    std::size_t longest_text = 0;  ///< characters; 0: no limit
    bool may_be_number = true;     ///< the text may look like a number to YAML
    bool holds_integers = false;   ///< a list of raw numbers
    std::string keys = {};         ///< pattern for the keys of a map with free keys
    std::string text = {};         ///< what it is for; one sentence
    std::string initial = {};      ///< what leaving it out means, in the file's notation; or ""
    std::string example = {};      ///< a value in the file's notation; or ""
    std::string change = {};       ///< what a change of it needs beside a reload; or ""
    int order = 0;                 ///< among the keys of its map
    Weaker weaker = {};
    bool may_be_pair = false;  ///< of Kind::text: a list of two says more
    bool may_be_text = false;  ///< of Kind::map, and of a list's maps: a text says the same
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

/// What changes of some keys need beside a reload.
inline constexpr std::string_view kOpensPort = "the port is opened anew";
inline constexpr std::string_view kListensAnew = "it listens anew, and its clients connect again";
inline constexpr std::string_view kConnectsAnew = "it connects to the broker anew";
inline constexpr std::string_view kAllowCloses = "clients outside `allow` are closed";
inline constexpr std::string_view kTlsCloses = "clients that are not let in any more are closed";
inline constexpr std::string_view kTlsRenewed = "for connections to come";
/// The change of a key that a reload cannot take over (KeyShape::change).
inline constexpr std::string_view kNextStart = "takes effect at the next start";

/// Every key of a configuration, as the rows of the tables say, each map before its keys.
struct Described {
    std::vector<KeyShape> keys;
    std::vector<KeyRule> rules;

    /// nullptr: there is none at this path.
    const KeyShape* find(std::string_view path) const;
    /// The key of a setting, or the map or list that it is in; nullptr: none.
    const KeyShape* of(const Setting& setting) const;
    /// "only with mode: kernel or rts", "not with type: bool", of a key whose presence depends on a
    /// neighbour; "" none.
    std::string condition_of(std::string_view key) const;

    std::map<std::string, std::size_t, std::less<>> places = {};  ///< in `keys`, by path
};
/// Made once, at the first call.
const Described& describe();

/// Returns the pattern of a template's name, as in KeyShape::pattern.
std::string name_pattern();
/// Returns the keys of which at least one must be present, neither null nor an empty list.
std::span<const std::string_view> serving_keys();

}  // namespace panelgate::config
