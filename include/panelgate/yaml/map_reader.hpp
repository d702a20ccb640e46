#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Where a key belongs that users often write in another place.
struct Elsewhere {
    std::string_view key;
    std::string_view map;           ///< key of the sibling map that has it; or
    std::string_view owner;         ///< what has it: "a station"
    std::string_view instead = {};  ///< if nothing has it: what to do, "remove it: ..."
    std::span<const std::string_view> words = {};  ///< its possible values, if it has such
    int top_column = 0;  ///< the column of the top level, if it is a key of that; else 0
};

/// Reads the keys of one map with types and ranges. Every getter returns nothing if the key is
/// absent or its value is wrong; a wrong value is added to the problems with its place and a
/// correction. finish() reports the keys that were not asked for, each with the nearest known one,
/// so ask for every known key before it. Does not own the node or the problems.
class MapReader {
  public:
    /// `what` names the map in messages: "a line", "serial". A node that is not a map is a problem,
    /// shown with an example such as "{mode: off}".
    MapReader(const Node& node, Problems& problems, std::string what,
              std::string_view example = {});
    ~MapReader() = default;
    MapReader(const MapReader&) = delete;
    MapReader& operator=(const MapReader&) = delete;

    static constexpr std::size_t kAnyNumber = 0;  ///< of entries
    /// Returns more about a wrong value, for the end of the message.
    using Hint = std::function<std::string(std::string_view typed)>;

    bool has(std::string_view key);
    /// Like has(), and absence is a problem.
    bool require(std::string_view key);
    /// True if finish() will report a mistyped or misplaced key that probably means `key`; a report
    /// of a missing `key` would say less.
    bool is_mistyped(std::string_view key) const;
    /// Returns any scalar as written, quoted or not; an empty one is a problem.
    std::optional<std::string> text(std::string_view key);
    /// Like text(), and absence is a problem.
    std::optional<std::string> required_text(std::string_view key);
    /// Returns a decimal integer in [min, max], without leading zeros or quotes (unless these
    /// enclose a variable).
    std::optional<std::int64_t> integer(std::string_view key, std::int64_t min, std::int64_t max);
    std::optional<std::int64_t> required_integer(std::string_view key, std::int64_t min,
                                                 std::int64_t max);
    std::optional<double> number(std::string_view key);
    /// Returns a number from 0 to 1.
    std::optional<double> share(std::string_view key);
    /// Accepts `true` and `false`, also as True and TRUE, nothing else (no yes, no on).
    std::optional<bool> boolean(std::string_view key);
    /// Returns a duration in [min, max]: `250us`, `20ms`, `2s`, `5min`; a bare number is a problem
    /// that asks for a unit.
    std::optional<Duration> duration(std::string_view key, Duration min, Duration max);
    /// Returns one of the words' values; anything else is a problem that lists the words (and the
    /// nearest).
    template <class T>
    std::optional<T> choice(std::string_view key,
                            std::span<const std::pair<std::string_view, T>> words,
                            const Hint& hint = {}) {
        std::vector<std::string_view> names;
        for (const auto& [name, value] : words) names.push_back(name);
        const std::optional<std::size_t> i = choice_index(key, names, hint);
        if (!i) return std::nullopt;
        return words[*i].second;
    }
    std::optional<std::size_t> choice_index(std::string_view key,
                                            std::span<const std::string_view> words,
                                            const Hint& hint = {});

    /// True if the value is this keyword, allowed besides another getter's values: auto.
    bool is_word(std::string_view key, std::string_view word);

    /// Returns the value of any kind; nullptr if absent or null.
    const Node* child(std::string_view key);
    /// Like child(), but another kind is a problem, shown with an example such as "{mode: off}".
    const Node* map(std::string_view key, std::string_view example = {});
    const Node* sequence(std::string_view key, std::string_view example = {});
    /// The entries of a list, at most so many: "at most 64 relays, not 65". None if it is absent.
    std::span<const Node> entries(std::string_view key, std::string_view example,
                                  std::size_t most = kAnyNumber);
    /// The scalars of a list; other items are problems.
    std::vector<const Node*> scalars(std::string_view key, std::string_view example);
    /// Reads a list with at least one entry, because an empty list could mean all or none; `any`
    /// says the meaning of a missing list.
    std::vector<const Node*> items(std::string_view key, std::string_view example,
                                   std::string_view any);
    /// Lets finish() report a key without a value, or with all of it commented out, as it means
    /// neither "all" nor "none"; the message ends with `instead`.
    void refuse_empty(std::string_view key, std::string_view instead);

    /// Adds keys that belong in another map, so that finish() names the right map. The keys must
    /// outlive the reader.
    void elsewhere(std::span<const Elsewhere> keys) { elsewhere_.push_back(keys); }

    /// Returns the place of the key's value (of the map if the key is absent), for later problems.
    Mark mark(std::string_view key) const;
    Mark mark() const { return node_->mark; }
    void problem(std::string_view key, std::string message);
    Problems& problems() { return *problems_; }
    const Node& node() const { return *node_; }

    /// Reports "KEY why" if a key of other versions is present; it is never suggested. `key` must
    /// outlive this.
    bool refuse(std::string_view key, const std::string& why);

    /// Reports unknown keys. Call once, last.
    void finish();

  private:
    const Node* find(std::string_view key);
    const Node* scalar(std::string_view key, std::string_view wanted);
    std::string needs(std::string_view key) const;
    const Entry* shallow_parent(std::size_t entry) const;
    std::string is_unknown(std::string_view key) const;
    std::string unknown(std::size_t entry) const;
    std::string place_of(const Entry& entry, bool exactly) const;
    std::string told(const Elsewhere& place, const Entry& entry, bool near) const;

    const Node* node_;
    Problems* problems_;
    std::string what_;
    std::vector<std::string> known_;
    std::vector<std::string_view> refused_;
    std::vector<std::string> excused_;  ///< required, absent, and probably mistyped
    std::vector<std::string> parents_;  ///< known keys with a map or a list
    std::vector<std::pair<std::string_view, std::string>> not_empty_;
    std::vector<std::span<const Elsewhere>> elsewhere_;
};

/// Returns "; did you mean 'x'?" if one of `known` is near, else "; known NOUN are a, b, c".
std::string did_you_mean(std::string_view typed, std::span<const std::string_view> known,
                         std::string_view noun);
/// Returns "there is no WHAT 'typed'", with the same behind it.
std::string no_such(std::string_view what, std::string_view typed,
                    std::span<const std::string_view> known);

/// Parse the text forms above for scalars that are not map values; nothing for other text. Units:
/// us, ms, s, min.
std::optional<Duration> parse_duration(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);
/// Regular expressions (ECMA 262) that match exactly these durations or integers, as the functions
/// above accept them; 0 <= min <= max. The one for integers is a part, without ^ and $.
inline constexpr std::string_view kIntegerPattern = "^(0|-?[1-9][0-9]*)$";
std::string duration_pattern(Duration min, Duration max);
std::string integer_pattern(std::int64_t min, std::int64_t max);
/// Formats in the largest unit that is exact: 1500ms, 2s, 250us; nanoseconds below.
std::string format_duration(Duration duration);
/// Formats in whole milliseconds, rounded up, for times on the wire.
std::string format_milliseconds(Duration duration);

}  // namespace panelgate::yaml
