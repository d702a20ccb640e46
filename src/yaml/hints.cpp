#include "hints.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include "panelgate/base/text.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::yaml {

namespace {

constexpr std::string_view kDigits = "0123456789";

/// Units as people write them, by their first letters: the longest that fits counts.
constexpr std::array<std::pair<std::string_view, Duration>, 6> kUnitsMeant{
    {{"us", 1us}, {"ms", 1ms}, {"milli", 1ms}, {"min", 60s}, {"s", 1s}, {"h", 3600s}}};

std::string write(std::string_view text) { return "; write " + std::string(text); }

std::string_view trim(std::string_view text) {
    return text.substr(std::min(text.find_first_not_of(' '), text.size()));
}

/// The number that a text begins with, with a decimal comma as a point; what is behind the number
/// goes to `rest`.
std::optional<double> leading_number(std::string_view text, std::string_view& rest) {
    const std::size_t end = std::min(text.find_first_not_of("0123456789.,-"), text.size());
    std::string digits(text.substr(0, end));
    std::ranges::replace(digits, ',', '.');
    rest = trim(text.substr(end));
    return parse_number(digits);
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && stop == text.data() + text.size();
    return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string duration_hint(std::string_view text) {
    std::string_view unit;
    const auto number = leading_number(text, unit);
    if (!number || *number < 0) return "";
    if (unit.empty()) return " (add a unit: us, ms, s, min)";
    const std::string name = to_lower(unit);
    if (name.find_first_of(kDigits) != name.npos) return "";
    const auto meant = std::ranges::find_if(
        kUnitsMeant, [&](const auto& one) { return name.starts_with(one.first); });
    constexpr double kMost = 1e18;  // of the 9.2e18 ns that a Duration holds
    if (name == "m" || meant == kUnitsMeant.end()) return name == "m" ? "; write ms or min" : "";
    const double exact = *number * static_cast<double>(meant->second.count());
    if (exact >= kMost || exact <= 0) return "";
    const std::string right = format_duration(Duration(std::llround(exact)));
    return parse_duration(right) && right != text ? write(right) : "";
}

std::string number_hint(std::string_view text, bool whole) {
    constexpr std::size_t kLongest = 40;
    if (text.empty() || text.size() > kLongest) return "";
    if (text.starts_with("0x")) {
        std::uint32_t value = 0;
        const char* end = text.data() + text.size();
        const auto [stop, error] = std::from_chars(text.data() + 2, end, value, 16);
        return error == std::errc() && stop == end ? write(std::to_string(value)) : "";
    }
    std::string digits(text);
    std::erase(digits, '_');
    std::string_view unit;
    const auto exact = parse_number(digits);  // 115_200, 1e3
    const auto number = exact ? exact : leading_number(text, unit);
    constexpr double kMost = 1e15;  // whole numbers that a double holds exactly
    const bool fits =
        number && std::fabs(*number) < kMost && (!whole || *number == std::floor(*number));
    if (!fits || unit.find_first_of(kDigits) != unit.npos) return "";
    const double value = unit == "%" && !whole ? *number / 100
                         : unit == "k"         ? *number * 1000
                                               : *number;
    const std::string meant = number_text(value);
    return meant == text ? "" : write(meant);
}

std::string boolean_hint(const Node& node) {
    constexpr std::array<std::string_view, 4> kTrue{"true", "yes", "on", "1"};
    constexpr std::array<std::string_view, 4> kFalse{"false", "no", "off", "0"};
    const std::string word = to_lower(node.scalar);
    const bool is_true = std::ranges::find(kTrue, word) != kTrue.end();
    if (!is_true && std::ranges::find(kFalse, word) == kFalse.end()) return "";
    return write(is_true ? "true" : "false") + (node.is_text() ? " without quotes" : "");
}

std::string origin_hint(const Node& node, std::string_view told) {
    if (node.variable.empty() || told.find("variable") != told.npos) return "";
    return "; it is the value of ${" + node.variable + "}: change the variable, or its default";
}

std::string text_hint(const Node& node, char opening) {
    if (node.kind != Node::Kind::scalar || !node.scalar.starts_with(opening)) return "";
    const std::string each = opening == '[' ? "[${ONE}, ${TWO}]" : "{key: ${NAME}}";
    return "; in quotes, or out of a variable, it is one text: leave the quotes out, or write " +
           each + ", a variable for each";
}

std::string none_hint(std::string_view key, std::string_view example, const Node& node) {
    constexpr std::array<std::string_view, 4> kNone{"off", "false", "no", "none"};
    const bool says_none = std::ranges::find(kNone, node.scalar) != kNone.end();
    if (!says_none || example.find("off") != example.npos) return "";
    return "; leave " + std::string(key) + " out for none";
}

std::string blank_hint(std::string_view text) {
    const std::size_t end =
        text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_-");
    if (end == 0 || end >= text.size() || text.substr(end).starts_with("://")) return "";
    const std::string key(text.substr(0, end));
    if (text[end] == '=') return write(key + ": " + std::string(trim(text.substr(end + 1))));
    return text[end] == ':' ? "; a blank is missing after '" + key + ":'" : "";
}

}  // namespace panelgate::yaml
