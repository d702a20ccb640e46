#pragma once

#include <algorithm>
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

#include "panelgate/access/settings.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "setting_writer.hpp"

namespace panelgate::config {

/// The words of a key and what they mean; static.
template <class T, std::size_t N>
using Words = std::array<std::pair<std::string_view, T>, N>;

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
template <class Value>
std::string as_written(const std::vector<Value>& list) {
    std::vector<std::string> words;
    for (const Value& one : list)
        words.push_back(std::integral<Value> ? as_written(one) : yaml::written(as_written(one)));
    std::ranges::sort(words);
    std::string text;
    for (const std::string& one : words) text += (text.empty() ? "" : ", ") + one;
    return words.empty() ? "" : '[' + text + ']';
}

/// One key of a map: a row of its table. S is what the key is read into, V what it is shown of.
template <class S, class V = S>
struct Row {
    using Shown = std::function<std::string(const V&)>;

    std::string_view key;
    std::string_view text;  ///< one sentence for the schema, the example file and the documentation
    /// What leaving it out means, in the file's notation; "" if that depends, or is nothing.
    std::string initial;
    /// Returns true if the key is present and valid. Empty: it is read by code of its own.
    std::function<bool(yaml::MapReader&, S&)> read;
    /// Returns the value in the file's notation. Empty: what it means is shown elsewhere.
    Shown shown;
    std::string_view change = {};  ///< what a change needs beside a reload; "" nothing
};

/// The keys that a map has set.
struct Given {
    std::vector<std::string_view> keys;
    bool has(std::string_view key) const { return std::ranges::find(keys, key) != keys.end(); }
};

/// Where the values of keys that are left out come from.
enum class Otherwise : std::uint8_t { initial, owner };

/// The table of a map: whatever concerns all keys alike is a member here.
template <class S, class V = S>
class Keys {
  public:
    using Shown = typename Row<S, V>::Shown;

    template <class Field>
    Keys duration(std::string_view key, Field field, Duration min, Duration max,
                  std::string_view text) && {
        return std::move(*this).add(
            key, text,
            [=](yaml::MapReader& in, S& into) {
                return store(in.duration(key, min, max), std::invoke(field, into));
            },
            [=](const V& of) { return as_written(std::invoke(field, of)); });
    }
    /// A duration, or `auto` for a member that is empty.
    template <class Field>
    Keys duration_or_auto(std::string_view key, Field field, Duration min, Duration max,
                          std::string_view text) && {
        return std::move(*this).add(
            key, text,
            [=](yaml::MapReader& in, S& into) {
                std::optional<Duration>& member = std::invoke(field, into);
                if (!in.is_word(key, "auto")) return store(in.duration(key, min, max), member);
                member.reset();
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
        return std::move(*this).add(
            key, text,
            [=](yaml::MapReader& in, S& into) {
                return store(in.integer(key, min, max), std::invoke(field, into));
            },
            [=](const V& of) { return as_written(std::invoke(field, of)); });
    }
    template <class Field>
    Keys boolean(std::string_view key, Field field, std::string_view text) && {
        return std::move(*this).add(
            key, text,
            [=](yaml::MapReader& in, S& into) {
                return store(in.boolean(key), std::invoke(field, into));
            },
            [=](const V& of) { return std::string(std::invoke(field, of) ? "true" : "false"); });
    }
    /// A number from 0 to 1.
    template <class Field>
    Keys share(std::string_view key, Field field, std::string_view text) && {
        return std::move(*this).add(
            key, text,
            [=](yaml::MapReader& in, S& into) {
                return store(in.share(key), std::invoke(field, into));
            },
            [=](const V& of) { return as_written(std::invoke(field, of)); });
    }
    /// A value that has none of the words is shown as "".
    template <class Field, class T, std::size_t N>
    Keys word(std::string_view key, Field field, const Words<T, N>& words, std::string_view text,
              const yaml::MapReader::Hint& hint = {}) && {
        return std::move(*this).add(
            key, text,
            [=, &words](yaml::MapReader& in, S& into) {
                return store(in.template choice<T>(key, words, hint), std::invoke(field, into));
            },
            [=, &words](const V& of) {
                const T value = std::invoke(field, of);
                const auto found =
                    std::ranges::find(words, value, &Words<T, N>::value_type::second);
                return found == words.end() ? "" : std::string(found->first);
            });
    }
    /// A key that code of its own reads, and shows.
    Keys other(std::string_view key, std::string_view text) && {
        return std::move(*this).add(key, text, {}, {});
    }
    /// The same, shown of a member, or of what a function returns.
    template <class Field>
    Keys other(std::string_view key, std::string_view text, Field field) && {
        return std::move(*this).add(
            key, text, {}, [=](const V& of) { return as_written(std::invoke(field, of)); });
    }
    /// The key before this is not set where this is false.
    Keys shown_if(std::function<bool(const V&)> is_set) && {
        rows_.back().shown = [shown = std::move(rows_.back().shown), is_set = std::move(is_set)](
                                 const V& of) { return is_set(of) ? shown(of) : std::string(); };
        return std::move(*this);
    }
    /// Replaces what leaving out the key before this means.
    Keys initially(std::string_view initial) && {
        rows_.back().initial = initial;
        return std::move(*this);
    }

    /// What a change of the key before this needs beside a reload; a key below it needs the same.
    Keys change_needs(std::string_view what) && {
        rows_.back().change = what;
        return std::move(*this);
    }

    /// Reads all keys that no other code reads, and describes all.
    Given read(yaml::MapReader& in, S& into, Otherwise otherwise = Otherwise::initial) const {
        Given given;
        for (const Row<S, V>& row : rows_) {
            if (row.read && row.read(in, into)) given.keys.push_back(row.key);
            in.about(row.key, otherwise == Otherwise::initial ? row.initial : "", row.text,
                     row.change);
        }
        return given;
    }
    std::vector<std::string_view> names() const {
        std::vector<std::string_view> all;
        for (const Row<S, V>& row : rows_) all.push_back(row.key);
        return all;
    }
    void show(const SettingWriter& out, const V& of) const {
        for (const Row<S, V>& row : rows_)
            if (row.shown) out.put(row.key, row.shown(of), row.initial);
    }
    /// The same; each is inherited from `owner`.
    void show(const SettingWriter& out, const V& of, const SettingWriter& owner) const {
        for (const Row<S, V>& row : rows_)
            if (row.shown) out.put(row.key, row.shown(of), owner, row.initial);
    }

  private:
    template <class Value, class Member>
    static bool store(const std::optional<Value>& value, Member& member) {
        if (value) member = static_cast<Member>(*value);
        return value.has_value();
    }
    Keys add(std::string_view key, std::string_view text,
             std::function<bool(yaml::MapReader&, S&)> read, Shown shown) && {
        std::string initial;
        if constexpr (std::default_initializable<V>) {
            if (read && shown) initial = shown(V{});
        }
        rows_.push_back({key, text, std::move(initial), std::move(read), std::move(shown), {}});
        return std::move(*this);
    }

    std::vector<Row<S, V>> rows_;
};

}  // namespace panelgate::config
