// Durations and integers, and the patterns of their texts.

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::yaml {

namespace {

struct Unit {
    std::string_view name;
    Duration length;
};
constexpr std::array<Unit, 4> kUnits{{{"min", 60s}, {"s", 1s}, {"ms", 1ms}, {"us", 1us}}};
constexpr std::int64_t kMostOfUnit = 1'000'000'000;

/// Pattern of the digits from `low` to `high`.
std::string digit(char low, char high) {
    if (low == high) return std::string(1, low);
    return std::string("[") + low + '-' + high + ']';
}

std::string any_digits(std::size_t count) {
    if (count == 0) return "";
    return count == 1 ? "[0-9]" : "[0-9]{" + std::to_string(count) + '}';
}

/// Pattern of the numbers from `low` to `high`, which have the same length.
std::string same_length(std::string_view low, std::string_view high) {
    if (low.empty()) return "";
    const std::size_t rest = low.size() - 1;
    const bool from_all = low.substr(1).find_first_not_of('0') == low.npos;
    const bool to_all = high.substr(1).find_first_not_of('9') == high.npos;
    if (from_all && to_all) return digit(low[0], high[0]) + any_digits(rest);
    if (low[0] == high[0]) return low[0] + ("(" + same_length(low.substr(1), high.substr(1)) + ')');
    const std::string nines(rest, '9');
    const std::string zeros(rest, '0');
    const char first = static_cast<char>(low[0] + (from_all ? 0 : 1));
    const char last = static_cast<char>(high[0] - (to_all ? 0 : 1));
    std::string pattern;
    if (!from_all) pattern = low[0] + ("(" + same_length(low.substr(1), nines) + ')');
    if (first <= last)
        pattern += (pattern.empty() ? "" : "|") + digit(first, last) + any_digits(rest);
    if (!to_all) pattern += "|" + (high[0] + ("(" + same_length(zeros, high.substr(1)) + ')'));
    return pattern;
}

/// Pattern without anchors.
std::string integers(std::int64_t min, std::int64_t max) {
    std::string pattern;
    while (min <= max) {
        const std::string low = std::to_string(min);
        const std::string high = std::to_string(max);
        const bool longer = high.size() > low.size();
        const std::string end = longer ? std::string(low.size(), '9') : high;
        pattern += (pattern.empty() ? "" : "|") + same_length(low, end);
        min = *parse_integer(end) + 1;
    }
    return pattern;
}

}  // namespace

std::optional<std::int64_t> parse_integer(std::string_view text) {
    const std::string_view digits = !text.empty() && text[0] == '-' ? text.substr(1) : text;
    if (digits.empty() || (text.size() > 1 && digits[0] == '0')) return std::nullopt;
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<Duration> parse_duration(std::string_view text) {
    const std::size_t letters = text.find_first_not_of("0123456789");
    if (letters == std::string_view::npos) return std::nullopt;
    const auto count = parse_integer(text.substr(0, letters));
    const auto unit = std::find_if(kUnits.begin(), kUnits.end(),
                                   [&](const Unit& u) { return u.name == text.substr(letters); });
    if (!count || unit == kUnits.end() || *count > kMostOfUnit) return std::nullopt;
    if (*count > Duration::max() / unit->length) return std::nullopt;
    return *count * unit->length;
}

std::string integer_pattern(std::int64_t min, std::int64_t max) {
    return '(' + integers(min, max) + ')';
}

std::string duration_pattern(Duration min, Duration max) {
    std::string pattern;
    for (const Unit& unit : kUnits) {
        const std::int64_t least = (min + unit.length - Duration(1)) / unit.length;
        const std::int64_t most = std::min<std::int64_t>(max / unit.length, kMostOfUnit);
        if (least > most) continue;
        pattern +=
            (pattern.empty() ? "(" : "|(") + integers(least, most) + ')' + std::string(unit.name);
    }
    return "^(" + pattern + ")$";
}

std::string format_duration(Duration duration) {
    if (duration == Duration::zero()) return "0ms";
    for (const Unit& unit : kUnits) {
        if (duration % unit.length == Duration::zero())
            return std::to_string(duration / unit.length) + std::string(unit.name);
    }
    return std::to_string(duration.count()) + "ns";
}

std::string format_milliseconds(Duration duration) {
    return format_duration(std::chrono::ceil<std::chrono::milliseconds>(duration));
}

}  // namespace panelgate::yaml
