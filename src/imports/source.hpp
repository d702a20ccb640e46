#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "draft.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::imports {

/// Returns the value of `all` whose label is behind this word in `words`: "int16=i16 uint16=u16".
template <class Value, std::size_t kCount>
std::optional<Value> meaning(std::string_view words, const std::string& word,
                             const std::array<Value, kCount>& all) {
    const std::string text = ' ' + std::string(words) + ' ';
    for (const Value one : all)
        if (text.find(' ' + word + '=' + std::string(label(one)) + ' ') != text.npos) return one;
    return std::nullopt;
}
inline constexpr auto kTypes = std::to_array(points::kTypes);
inline constexpr auto kOrders = std::to_array(points::kOrders);

std::optional<std::string> text_itself(const std::string& text);
std::optional<double> number_of(const std::string& text);
/// At most 32 bits, decimal or with 0x.
std::optional<std::int64_t> integer_of(const std::string& text);
/// "1m30s", "500ms"; a number without a unit is so many seconds.
std::optional<Duration> duration_of(const std::string& text);

/// A map of the other program's file. Keeps which keys were asked for, and the first fault.
class Source {
  public:
    /// `kind` names all maps of this sort, and stands in for a missing name.
    Source(const yaml::Node& node, std::string kind, Draft& draft,
           std::string_view name_key = "name");

    /// Returns the value of a key as `parse` reads the scalar; a key with another value is left
    /// over.
    template <class Value>
    std::optional<Value> guess(std::string_view key,
                               std::optional<Value> (*parse)(const std::string&)) {
        const yaml::Node* const found = node_.find(key);
        const bool is_scalar = found != nullptr && found->kind == yaml::Node::Kind::scalar;
        const auto value = is_scalar ? parse(found->scalar) : std::nullopt;
        if (value) used_.emplace(key);
        return value;
    }
    /// Like guess(), but a key with another value is a fault.
    template <class Value>
    Value get(std::string_view key, std::optional<Value> (*parse)(const std::string&),
              std::type_identity_t<Value> otherwise) {
        const auto value = guess(key, parse);
        if (!value) refuse(key);
        return value.value_or(otherwise);
    }
    std::string text(std::string_view key, const std::string& otherwise = "") {
        return get(key, text_itself, otherwise);
    }
    /// Like text(), but a missing key is a fault.
    std::string needed(std::string_view key);
    /// Returns the items of a list; a single value counts as a list of one.
    std::vector<const yaml::Node*> list(std::string_view key);

    void fail(const std::string& fault);
    bool is_fine() const { return fault_.empty(); }
    /// Notes the fault, or else every key that nobody asked for. Returns is_fine(). Call once,
    /// last.
    bool finish();
    const std::string& name() const { return name_; }
    int line() const { return node_.mark.line; }

  private:
    /// Makes the key's value a fault, if there is such a key.
    void refuse(std::string_view key);

    const yaml::Node& node_;
    std::string kind_;
    Draft& draft_;
    std::set<std::string, std::less<>> used_{};
    std::string fault_{};
    std::string name_;
};

/// The map `serial` of a line.
std::string serial_map(Source& in, std::string_view baud, std::string_view data_bits,
                       std::string_view stop_bits, bool ascii);
/// The keys of a line that say how long it waits.
std::map<std::string, std::string> waits_of(std::optional<Duration> timeout,
                                            std::optional<Duration> gap,
                                            std::optional<Duration> connect);

}  // namespace panelgate::imports
