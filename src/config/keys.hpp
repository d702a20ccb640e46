#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "loader.hpp"
#include "panelgate/access/settings.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/describe.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/yaml/document.hpp"
#include "setting_writer.hpp"
#include "table.hpp"

namespace panelgate::config {

/// The words of a key and what they mean; static.
template <class T, std::size_t N>
using Words = std::array<std::pair<std::string_view, T>, N>;

template <class T, std::size_t N>
std::vector<std::string_view> names_of(const Words<T, N>& words) {
    std::vector<std::string_view> names;
    for (const auto& [name, value] : words) names.push_back(name);
    return names;
}

// Values as they are written in the file.

inline std::string as_written(std::string text) { return text; }
inline std::string as_written(double number) { return number_text(number); }
inline std::string as_written(Duration duration) { return yaml::format_duration(duration); }
inline std::string as_written(const Decimal& number) { return number.text(); }
inline std::string as_written(const Network& network) { return network_text(network); }
inline std::string as_written(const access::Place& place) {
    return place.first + '/' + std::to_string(place.second);
}
template <std::integral Number>
std::string as_written(Number number) {
    if constexpr (std::same_as<Number, bool>) return number ? "true" : "false";
    return std::to_string(number);
}
template <class Word>
    requires std::is_enum_v<Word>
std::string as_written(Word word) {
    return std::string(label(word));
}
/// "" of nothing.
template <class Value>
std::string as_written(const std::optional<Value>& value) {
    return value ? as_written(*value) : "";
}
/// "[a, b]", in the order of the alphabet, as theirs means nothing; "" of an empty list.
std::string list_text(std::vector<std::string> words);
template <class Value>
std::string as_written(const std::vector<Value>& list) {
    std::vector<std::string> words;
    for (const Value& one : list)
        words.push_back(std::integral<Value> ? as_written(one) : yaml::written(as_written(one)));
    return list_text(std::move(words));
}

using By = Weaker::By;
using Kind = KeyShape::Kind;

/// The keys that a map has set.
struct Given {
    std::vector<std::string_view> keys;
    bool has(std::string_view key) const { return std::ranges::find(keys, key) != keys.end(); }
};

/// Reads a text of the form; reports a text of another form and returns nothing.
std::optional<std::string> read_text(Reader& in, std::string_view key, const Form& form);
/// Reads a number with all its digits.
std::optional<Decimal> read_number(Reader& in, std::string_view key);
/// Reads a number; more digits than a double holds are a problem.
std::optional<double> read_exact(Reader& in, std::string_view key);

/// The whole path of a file that is written; `example` is told where it is none.
Form whole_path(const std::string& example);
/// A size such as 50MiB.
KeyShape size_shape(std::string_view key, std::string_view text);
/// Reads such a size, in bytes.
std::optional<std::uint64_t> read_size(Reader& in, std::string_view key, std::uint64_t least,
                                       std::uint64_t most);
/// Returns "50MiB".
std::string size_text(std::uint64_t bytes);

/// Reads an item of a list of networks.
std::function<std::optional<Network>(Reader&, const yaml::Node&)> read_network(
    std::string_view key);
Items network_items(std::string_view any);

/// The table of a map: S is what its keys are read into, V what they are shown of.
template <class S, class V = S>
class Keys : public Table {
  public:
    /// Returns true if the key is present and valid.
    using Read = std::function<bool(Reader&, S&)>;
    /// Returns the value in the file's notation.
    using Shown = std::function<std::string(const V&)>;
    /// Shows a map, or each of a list. `owner`: the map from which it inherits, or null.
    using Show = std::function<void(const SettingWriter&, const V&, const SettingWriter* owner)>;

    // Kinds of values. A field is a member, or a function that returns one.

    /// A value of any kind.
    Keys value(KeyShape shape, Read read, Shown shown) && {
        if constexpr (std::default_initializable<V>) {
            if (shown) shape.initial = shown(V{});
        }
        rows_.push_back({std::move(shape)});
        ways_.push_back({std::move(read), std::move(shown), {}});
        return std::move(*this);
    }
    template <class Field>
    Keys duration(std::string_view key, Field field, Duration min, Duration max,
                  std::string_view text) && {
        return std::move(*this).value(
            durations(key, min, max, text),
            [=](Reader& in, S& into) { return store(in.duration(key, min, max), field, into); },
            written(field));
    }
    /// A duration, or `auto` for a member that is empty.
    template <class Field>
    Keys duration_or_auto(std::string_view key, Field field, Duration min, Duration max,
                          std::string_view text) && {
        KeyShape shape = durations(key, min, max, text);
        shape.words = {"auto"};
        return std::move(*this).value(
            std::move(shape),
            [=](Reader& in, S& into) {
                if (!in.is_word(key, "auto")) return store(in.duration(key, min, max), field, into);
                std::invoke(field, into).reset();
                return true;
            },
            [=](const V& of) {
                const std::optional<Duration>& member = std::invoke(field, of);
                return member ? yaml::format_duration(*member) : "auto";
            });
    }
    template <class Field>
    Keys integer(std::string_view key, Field field, std::int64_t min, std::int64_t max,
                 std::string_view text) && {
        return std::move(*this).value(
            integers(key, min, max, text),
            [=](Reader& in, S& into) { return store(in.integer(key, min, max), field, into); },
            written(field));
    }
    /// With all digits, where the member has them; else more digits than it has are a problem.
    template <class Field>
    Keys number(std::string_view key, Field field, std::string_view text) && {
        return std::move(*this).value(
            shape_of(key, KeyShape::Kind::number, text),
            [=](Reader& in, S& into) {
                using Member = std::remove_cvref_t<std::invoke_result_t<Field, S&>>;
                if constexpr (std::same_as<Member, double> ||
                              std::same_as<Member, std::optional<double>>)
                    return store(read_exact(in, key), field, into);
                else
                    return store(read_number(in, key), field, into);
            },
            written(field));
    }
    /// A number from 0 to 1.
    template <class Field>
    Keys share(std::string_view key, Field field, std::string_view text) && {
        KeyShape shape = shape_of(key, KeyShape::Kind::number, text);
        shape.least = 0;
        shape.most = 1;
        return std::move(*this).value(
            std::move(shape),
            [=](Reader& in, S& into) { return store(in.share(key), field, into); }, written(field));
    }
    template <class Field>
    Keys boolean(std::string_view key, Field field, std::string_view text) && {
        return std::move(*this).value(
            shape_of(key, KeyShape::Kind::boolean, text),
            [=](Reader& in, S& into) { return store(in.boolean(key), field, into); },
            written(field));
    }
    /// A value that has none of the words is shown as "".
    template <class Field, class T, std::size_t N>
    Keys word(std::string_view key, Field field, const Words<T, N>& words, std::string_view text,
              const yaml::MapReader::Hint& hint = {}) && {
        return std::move(*this).value(
            words_shape(key, names_of(words), text),
            [=, &words](Reader& in, S& into) {
                return store(in.template choice<T>(key, words, hint), field, into);
            },
            [=, &words](const V& of) {
                const T value = std::invoke(field, of);
                const auto found =
                    std::ranges::find(words, value, &Words<T, N>::value_type::second);
                return found == words.end() ? "" : std::string(found->first);
            });
    }
    template <class Field>
    Keys text(std::string_view key, Field field, const Form& form, std::string_view text) && {
        return std::move(*this).value(
            text_shape(key, form, text),
            [=](Reader& in, S& into) { return store(read_text(in, key, form), field, into); },
            written(field));
    }
    /// The path of a file; a relative one is beside the configuration.
    template <class Field>
    Keys path(std::string_view key, Field field, std::string_view text) && {
        return std::move(*this).value(
            text_shape(key, {}, text),
            [=](Reader& in, S& into) {
                const auto typed = in.text(key);
                if (typed) std::invoke(field, into) = in.loading.path_of(*typed);
                return typed.has_value();
            },
            written(field));
    }
    /// A list of scalars. `parse` returns an item's value; nothing, and a problem, of a wrong item.
    template <class Field, class Parse>
    Keys list(std::string_view key, Field field, const Items& items, Parse parse,
              std::string_view text) && {
        return std::move(*this).value(
            items_shape(key, items, text),
            [=](Reader& in, S& into) {
                const auto all = items.any.empty() ? in.scalars(key, items.example)
                                                   : in.items(key, items.example, items.any);
                for (const yaml::Node* item : all)
                    if (auto one = parse(in, *item))
                        std::invoke(field, into).push_back(std::move(*one));
                return !all.empty();
            },
            written(field));
    }
    template <class Field>
    Keys networks(std::string_view key, Field field, std::string_view any,
                  std::string_view text) && {
        return std::move(*this).list(key, field, network_items(any), read_network(key), text);
    }
    /// Words that each mean one value of the list.
    template <class Field, class T, std::size_t N>
    Keys words(std::string_view key, Field field, Items items, const Words<T, N>& words,
               std::string_view what, std::string_view text) && {
        for (const auto& [name, value] : words)
            items.pattern += (items.pattern.empty() ? "^(" : "|") + std::string(name);
        items.pattern += ")$";
        return std::move(*this).list(
            key, field, items,
            [=, &words](Reader& in, const yaml::Node& item) -> std::optional<T> {
                const auto found =
                    std::ranges::find(words, item.scalar, &Words<T, N>::value_type::first);
                if (found != words.end()) return found->second;
                in.problems().add(item.mark, yaml::no_such(what, item.scalar, names_of(words)));
                return std::nullopt;
            },
            text);
    }

    // Maps and lists of maps

    /// A map, or a list of maps, that code reads and shows by the table `below`.
    Keys below(KeyShape shape, std::function<const Table&()> below, Read read, Show show) && {
        rows_.push_back({std::move(shape), std::move(below)});
        ways_.push_back({std::move(read), {}, std::move(show)});
        return std::move(*this);
    }
    /// A map whose rows are read into a member; then `check` is called.
    template <class Field, class T, class U>
    Keys map(std::string_view key, Field field, const Keys<T, U>& (*table)(),
             std::string_view example, std::string_view text,
             const std::function<void(Reader&, S&)>& check = {}) && {
        return std::move(*this).below(
            shape_of(key, KeyShape::Kind::map, text), [=]() -> const Table& { return table(); },
            [=](Reader& in, S& into) {
                const yaml::Node* node = in.map(key, example);
                if (node == nullptr) return false;
                Reader inside(in.loading, *node, std::string(key));
                if (in.top) inside.elsewhere(in.loading.top_keys);
                table().read(inside, std::invoke(field, into));
                if (check) check(inside, into);
                inside.finish();
                return true;
            },
            [=](const SettingWriter& out, const V& of, const SettingWriter*) {
                table().show(out.below(key), std::invoke(field, of));
            });
    }
    /// A list of maps, at most so many. `load` returns what an entry means; nothing of one that
    /// cannot be used. `name` is what an entry is called.
    template <class Field, class T, class U, class Load, class Name>
    Keys maps(std::string_view key, Field field, const Keys<T, U>& (*table)(),
              std::string_view example, std::size_t most, Load load, Name name,
              std::string_view text) && {
        KeyShape shape = shape_of(key, KeyShape::Kind::list, text);
        shape.most_entries = most;
        return std::move(*this).below(
            std::move(shape), [=]() -> const Table& { return table(); },
            [=](Reader& in, S& into) {
                for (const yaml::Node& node : in.entries(key, example, most))
                    if (auto one = load(in, node))
                        std::invoke(field, into).push_back(std::move(*one));
                return in.has(key);
            },
            [=](const SettingWriter& out, const V& of, const SettingWriter*) {
                Distinct names;
                for (const auto& one : std::invoke(field, of))
                    table().show(out.item(key, names.name(std::invoke(name, one))), one);
            });
    }
    /// Adds all rows of another table; the keys of both tables are in the same map.
    template <class Field, class T, class U>
    Keys with(const Keys<T, U>& other, Field field) && {
        rows_.insert(rows_.end(), other.rows_.begin(), other.rows_.end());
        conditions_.insert(conditions_.end(), other.conditions_.begin(), other.conditions_.end());
        for (const auto& way : other.ways_) {
            Way made;
            made.read = [read = way.read, field](Reader& in, S& into) {
                return read(in, std::invoke(field, into));
            };
            if (way.shown)
                made.shown = [shown = way.shown, field](const V& of) {
                    return shown(std::invoke(field, of));
                };
            if (way.show)
                made.show = [show = way.show, field](const SettingWriter& out, const V& of,
                                                     const SettingWriter* owner) {
                    show(out, std::invoke(field, of), owner);
                };
            ways_.push_back(std::move(made));
        }
        return std::move(*this);
    }

    // More about the key before this

    /// What the schema says of it besides.
    Keys in_schema(const std::function<void(KeyShape&)>& change) && {
        change(rows_.back().shape);
        return std::move(*this);
    }

    /// It must be there: "a station needs 'id'".
    Keys required() && {
        KeyShape& shape = rows_.back().shape;
        shape.required = true;
        shape.initial.clear();
        Way& way = ways_.back();
        way.read = [read = std::move(way.read), key = shape.path](Reader& in, S& into) {
            return in.require(key) && read(in, into);
        };
        return std::move(*this);
    }
    /// It is not set where this is false.
    Keys shown_if(std::function<bool(const V&)> is_set) && {
        ways_.back().shown = [shown = std::move(ways_.back().shown), is_set = std::move(is_set)](
                                 const V& of) { return is_set(of) ? shown(of) : std::string(); };
        return std::move(*this);
    }
    /// It is shown so.
    Keys shown_as(Shown shown) && {
        ways_.back().shown = std::move(shown);
        return std::move(*this);
    }
    /// What leaving it out means.
    Keys initially(std::string_view initial) && {
        rows_.back().shape.initial = initial;
        return std::move(*this);
    }
    Keys example(std::string_view example) && {
        rows_.back().shape.example = example;
        return std::move(*this);
    }
    /// Says what a change of the key needs beside a reload; keys below the key need the same.
    Keys change_needs(std::string_view what) && {
        rows_.back().shape.change = what;
        return std::move(*this);
    }
    /// Which change of it protects the panels less.
    Keys weaker(Weaker::By by, std::string_view word = {}, std::vector<std::string> ranks = {}) && {
        rows_.back().shape.weaker = {by, std::string(word), std::move(ranks)};
        return std::move(*this);
    }
    /// Missing keys below the map have the values of the owner's map.
    Keys inherited() && {
        rows_.back().inherits = true;
        return std::move(*this);
    }
    /// An empty map or list means neither all nor nothing; `instead` says what to write.
    Keys not_empty(std::string_view instead) && {
        KeyShape& shape = rows_.back().shape;
        shape.may_be_null = false;
        Way& way = ways_.back();
        way.read = [read = std::move(way.read), key = shape.path, instead](Reader& in, S& into) {
            in.refuse_empty(key, instead);
            return read(in, into);
        };
        return std::move(*this);
    }
    /// The key may be present only if `other` has one of the words, or, with `absent`, if `other`
    /// is missing; otherwise "KEY why" is reported.
    Keys only_with(std::string_view other, std::vector<std::string> words, std::string_view why,
                   bool absent = false) && {
        conditions_.push_back(
            {{"", rows_.back().shape.path, std::string(other), std::move(words), false, absent},
             std::string(why)});
        return std::move(*this);
    }
    /// If the value is `word`, the key `other` must be present; otherwise "KEY why" is reported.
    Keys needs(std::string_view word, std::string_view other, std::string_view why) && {
        conditions_.push_back(
            {{"", rows_.back().shape.path, std::string(other), {std::string(word)}, true, false},
             std::string(why)});
        return std::move(*this);
    }

    // Visitors

    Given read(Reader& in, S& into) const {
        Given given;
        for (std::size_t i = 0; i < rows_.size(); ++i)
            if (ways_[i].read(in, into)) given.keys.push_back(rows_[i].shape.path);
        check(in);
        return given;
    }
    /// `owner`: the map from which the keys are inherited, or null.
    void show(const SettingWriter& out, const V& of, const SettingWriter* owner = nullptr) const {
        show_values(out, of, owner);
        show_maps(out, of, owner);
    }
    void show_values(const SettingWriter& out, const V& of, const SettingWriter* owner) const {
        const std::size_t first = out.size();
        for (std::size_t i = 0; i < rows_.size(); ++i)
            if (ways_[i].shown) out.put(rows_[i].shape, ways_[i].shown(of), owner);
        mark_idle(out.since(first));
    }
    void show_maps(const SettingWriter& out, const V& of, const SettingWriter* owner,
                   std::string_view except = {}) const {
        for (std::size_t i = 0; i < rows_.size(); ++i)
            if (ways_[i].show && rows_[i].shape.path != except) ways_[i].show(out, of, owner);
    }

  private:
    template <class T, class U>
    friend class Keys;

    struct Way {
        Read read;
        Shown shown;
        Show show;
    };

    template <class Value, class Field>
    static bool store(std::optional<Value> value, const Field& field, S& into) {
        if (!value) return false;
        auto& member = std::invoke(field, into);
        member = static_cast<std::remove_cvref_t<decltype(member)>>(std::move(*value));
        return true;
    }
    template <class Field>
    static Shown written(const Field& field) {
        return [=](const V& of) { return as_written(std::invoke(field, of)); };
    }

    std::vector<Way> ways_;
};

}  // namespace panelgate::config
