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
#include "panelgate/yaml/description.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// Where a key stands that people write elsewhere.
struct Elsewhere {
    std::string_view key;
    std::string_view map;           ///< key of the map that has it, beside where it was written; or
    std::string_view owner;         ///< who has it: "a station"
    std::string_view instead = {};  ///< nobody has it: what to do, "remove it: ..."
    std::span<const std::string_view> words = {};  ///< if its values are such
};

/// Reads the keys of one map with types and ranges. Every getter returns nothing both when the key
/// is absent and when its value is wrong; a wrong value has then been added to the problems with
/// its place and what would be right. finish() reports the keys nobody asked for, each with the
/// nearest known one, so ask for every key you know before it. Does not own the node or the
/// problems.
class MapReader {
  public:
    /// `what` names the map in messages: "a line", "serial". A node that is not a map is a problem,
    /// told with an example such as "{mode: off}".
    MapReader(const Node& node, Problems& problems, std::string what,
              std::string_view example = {});
    ~MapReader() = default;
    MapReader(const MapReader&) = delete;
    MapReader& operator=(const MapReader&) = delete;

    bool has(std::string_view key);
    /// finish() will tell of a key that is probably this one, or belongs below it: that says more
    /// than that it is missing.
    bool is_mistyped(std::string_view key) const;
    /// Any scalar as it was written, quoted or not; an empty one is a problem.
    std::optional<std::string> text(std::string_view key);
    /// As text(), and its absence is a problem.
    std::optional<std::string> required_text(std::string_view key);
    /// A decimal integer without leading zeros or quotes (those around a variable aside), inside
    /// [min, max].
    std::optional<std::int64_t> integer(std::string_view key, std::int64_t min, std::int64_t max);
    std::optional<std::int64_t> required_integer(std::string_view key, std::int64_t min,
                                                 std::int64_t max);
    std::optional<double> number(std::string_view key);
    /// A number from 0 to 1.
    std::optional<double> share(std::string_view key);
    /// `true` or `false`, also as True and TRUE, nothing else (no yes, no on).
    std::optional<bool> boolean(std::string_view key);
    /// `250us`, `20ms`, `2s`, `5min` inside [min, max]; a bare number is a problem that asks for a
    /// unit.
    std::optional<Duration> duration(std::string_view key, Duration min, Duration max);
    /// One of the words; anything else is a problem that lists them (and the nearest).
    template <class T>
    std::optional<T> choice(std::string_view key,
                            std::span<const std::pair<std::string_view, T>> words) {
        std::vector<std::string_view> names;
        for (const auto& [name, value] : words) names.push_back(name);
        const std::optional<std::size_t> i = choice_index(key, names);
        if (!i) return std::nullopt;
        return words[*i].second;
    }
    /// What else is to be said of a wrong value, as the end of the message.
    using Hint = std::function<std::string(std::string_view typed)>;
    std::optional<std::size_t> choice_index(std::string_view key,
                                            std::span<const std::string_view> words,
                                            const Hint& hint = {});

    /// The value is this word, which stands for itself beside what another getter takes: auto.
    bool is_word(std::string_view key, std::string_view word);

    /// The value itself, of any kind but null; nullptr when absent or null.
    const Node* child(std::string_view key);
    /// As child(), and another kind is a problem, told with an example such as "{mode: off}".
    const Node* map(std::string_view key, std::string_view example = {});
    const Node* sequence(std::string_view key, std::string_view example = {});

    // What the caller looks at itself, for who writes down what is asked (Description). Call it
    // where the value is judged; what is told of one key counts together.

    /// A text, or those in a list or map, matches this regular expression (ECMA 262); `number`: one
    /// that YAML takes for a number may.
    void looks_like(std::string_view key, std::string_view pattern, bool number = false);
    void no_longer(std::string_view key, std::size_t characters);
    /// The same of the keys of a map that has no words for them.
    void keyed_by(std::string_view key, std::string_view pattern);
    /// Of a list: raw numbers.
    void holds_integers(std::string_view key);
    /// Less than what integer() was asked for.
    void within(std::string_view key, std::int64_t min, std::int64_t max);
    void never(std::string_view key, double number);
    void may_be_null(std::string_view key, bool may);
    void needed(std::string_view key);
    /// `most` 0: no limit.
    void entries(std::string_view key, std::size_t fewest, std::size_t most);
    /// `key` has this word and `other` is absent, which it needs then.
    bool lacks(std::string_view key, std::string_view word, std::string_view other);
    /// `key` belongs to these words of `other`; `absent`: and to none.
    void belongs(std::string_view key, std::string_view other,
                 std::span<const std::string_view> words, bool absent = false);

    /// Keys that stand in another map: finish() says where. Must outlive this.
    void elsewhere(std::span<const Elsewhere> keys) { elsewhere_ = keys; }

    /// Where the key's value stands (the map itself when the key is absent), for later problems.
    Mark mark(std::string_view key) const;
    Mark mark() const { return node_->mark; }
    void problem(std::string_view key, std::string message);
    Problems& problems() { return *problems_; }

    /// A key of other versions: a problem, "KEY why", where it stands, and never proposed. `key`
    /// must outlive this.
    void refuse(std::string_view key, const std::string& why);

    /// Reports unknown keys. Call once, last.
    void finish();

  private:
    void describe(std::string_view key, KeyShape shape);
    void describe(std::string_view key, KeyShape::Kind kind) {
        KeyShape shape;
        shape.kind = kind;
        describe(key, std::move(shape));
    }
    KeyShape* shape(std::string_view key);
    const Node* below(std::string_view key, const Node* node);
    const Node* find(std::string_view key);
    const Node* scalar(std::string_view key, std::string_view wanted);
    bool require(std::string_view key);
    std::string needs(std::string_view key) const;
    const Entry* shallow_parent(std::size_t entry) const;
    std::string is_unknown(std::string_view key) const;
    std::string unknown(std::size_t entry) const;
    std::string place_of(const Entry& entry, bool exactly) const;

    const Node* node_;
    Problems* problems_;
    std::string what_;
    std::vector<std::string> known_;
    std::vector<std::string_view> refused_;
    std::vector<std::string> excused_;  ///< required, absent, and likely to be mistyped
    std::vector<std::string> parents_;  ///< of these, those with a map or a list
    std::span<const Elsewhere> elsewhere_;
};

/// The text forms above, for scalars that are not map values. Nothing when the text is not one.
/// Units: us, ms, s, min.
std::optional<Duration> parse_duration(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);
/// A regular expression (ECMA 262) of just the texts of these durations, or integers, as the
/// functions above take them; 0 <= min <= max. That of integers is a part, without ^ and $.
inline constexpr std::string_view kIntegerPattern = "^(0|-?[1-9][0-9]*)$";
std::string duration_pattern(Duration min, Duration max);
std::string integer_pattern(std::int64_t min, std::int64_t max);
/// "; a blank is missing after '101:'; write 101: floor1/31" for a key that is a number, a colon
/// and its value; else "".
std::string number_blank_hint(std::string_view key);
/// In the largest unit that is exact: 1500ms, 2s, 250us; nanoseconds below.
std::string format_duration(Duration duration);
/// That of whole milliseconds, rounded up: a time on the wire has no shorter text.
std::string format_milliseconds(Duration duration);

}  // namespace panelgate::yaml
