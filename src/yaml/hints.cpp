#include "hints.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>

#include "encoding.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::yaml {

namespace {

constexpr std::string_view kDecimalDigits = "0123456789";

char lower_of(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string lower(std::string_view text) {
    std::string all(text);
    std::ranges::transform(all, all.begin(), lower_of);
    return all;
}

struct Word {
    std::string_view word;
    Duration length;
};
constexpr std::array<Word, 25> kDurationUnits{
    {{"us", 1us},           {"\xC2\xB5s", 1us}, {"usec", 1us},    {"ms", 1ms},
     {"msec", 1ms},         {"msecs", 1ms},     {"millis", 1ms},  {"millisecond", 1ms},
     {"milliseconds", 1ms}, {"s", 1s},          {"sec", 1s},      {"secs", 1s},
     {"second", 1s},        {"seconds", 1s},    {"m", 60s},       {"min", 60s},
     {"mins", 60s},         {"minute", 60s},    {"minutes", 60s}, {"h", 3600s},
     {"hr", 3600s},         {"hour", 3600s},    {"hours", 3600s}, {"d", 86400s},
     {"day", 86400s}}};

std::string_view trim(std::string_view text) {
    const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
    return text.substr(begin);
}

/// Takes "1.5 S" from the start of `text`.
std::optional<Duration> take_part(std::string_view& text) {
    const std::size_t number = std::min(text.find_first_not_of("0123456789.,"), text.size());
    std::string digits(text.substr(0, number));
    std::ranges::replace(digits, ',', '.');
    const auto value = parse_number(digits);
    if (!value) return std::nullopt;
    text = trim(text.substr(number));
    const std::size_t unit = std::min(text.find_first_of("0123456789 "), text.size());
    const std::string name = lower(text.substr(0, unit));
    const auto word = std::ranges::find(kDurationUnits, std::string_view(name), &Word::word);
    if (word == kDurationUnits.end()) return std::nullopt;
    text = trim(text.substr(unit));
    const double exact = *value * static_cast<double>(word->length.count());
    constexpr double kMost = 1e18;  // of the 9.2e18 ns that a Duration holds
    if (!(exact < kMost)) return std::nullopt;
    return Duration(std::llround(exact));
}

/// As from_chars reads it.
std::optional<std::string> plain_number(std::string_view text, bool whole) {
    const auto value = parse_number(text);
    if (!value || !whole) return value ? std::optional(std::string(text)) : std::nullopt;
    constexpr double kMost = 1e15;  // whole numbers that a double holds exactly
    if (*value != std::floor(*value) || std::fabs(*value) > kMost) return std::nullopt;
    return std::to_string(static_cast<std::int64_t>(*value));
}

std::optional<std::string> hexadecimal(std::string_view text) {
    if (!text.starts_with("0x") && !text.starts_with("0X")) return std::nullopt;
    std::uint32_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + 2, end, value, 16);
    if (error != std::errc() || stop != end) return std::nullopt;
    return std::to_string(value);
}

/// Factors as people write them: x0.1, 1/10, /10 and 10^-1; 9.6k.
std::optional<double> factor(std::string_view text) {
    if (text.starts_with('x')) text.remove_prefix(1);
    const std::size_t sign = std::min(text.find_first_of("/^k"), text.size());
    const auto left = text.starts_with('/') ? 1 : parse_number(text.substr(0, sign));
    if (!left || sign == text.size()) return left;
    if (text.substr(sign) == "k") return *left * 1000;
    const auto right = parse_number(text.substr(sign + 1));
    if (!right || text[sign] == 'k') return std::nullopt;
    return text[sign] == '/' ? *left / *right : std::pow(*left, *right);
}

/// 600 of 9,600
bool is_group(std::string_view text) {
    return text.size() == 3 && text.find_first_not_of(kDecimalDigits) == text.npos;
}

/// Removes a plus, leading zeros, group separators and a unit; uses a decimal point.
std::string bare(std::string_view text, bool whole) {
    std::string all;
    const std::size_t unit = text.find_last_of(kDecimalDigits);
    text = text.substr(0, unit == text.npos ? text.size() : unit + 1);
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool is_point = text[i] == ',' || text[i] == '.';
        const bool group = text[i] == '_' || text[i] == ' ' || text[i] == '\'' ||
                           (whole && is_point && is_group(text.substr(i + 1)));
        if (!group) all += text[i] == ',' ? '.' : text[i];
    }
    if (all.starts_with('+')) all.erase(0, 1);
    const std::size_t sign = all.starts_with('-') ? 1 : 0;
    while (all.size() > sign + 1 && all[sign] == '0' &&
           kDecimalDigits.find(all[sign + 1]) != kDecimalDigits.npos)
        all.erase(sign, 1);
    return all;
}

std::string write(std::string_view text) { return "; write " + std::string(text); }

/// Hint for 20,21 where one number is wanted, and 1,234, which may be a fraction.
std::string comma_hint(std::string_view text, bool whole) {
    const std::size_t comma = text.find(',');
    if (comma == text.npos || comma == 0 || text.find_first_not_of("-0123456789,") != text.npos)
        return "";
    const std::string first(text.substr(0, comma));
    const std::string second(text.substr(comma + 1));
    if (second.empty()) return "";
    if (second.find(',') != second.npos) return whole ? "; one number is wanted, not a list" : "";
    if (!whole) {
        const std::string fraction = first + '.' + second;
        return is_group(second) ? write(first + second + ", or " + fraction + " for a fraction")
                                : "";
    }
    return is_group(second) ? "" : "; one number is wanted: write " + first + " or " + second;
}

/// Shares are numbers from 0 to 1.
std::string percent_hint(std::string_view text) {
    const auto value = parse_number(text.substr(0, text.size() - 1));
    return value ? write(number_text(*value / 100)) : "";
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && stop == text.data() + text.size();
    return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string duration_hint(std::string_view text) {
    const std::size_t number = text.find_first_not_of("0123456789.,");
    if (!text.empty() && number == text.npos) return " (add a unit: us, ms, s, min)";
    Duration sum = Duration::zero();
    for (std::string_view rest = trim(text); !rest.empty();) {
        const auto part = take_part(rest);
        if (!part || *part > Duration::max() - sum) return "";
        sum += *part;
    }
    const std::string meant = format_duration(sum);
    return sum > Duration::zero() && parse_duration(meant) && meant != text ? write(meant) : "";
}

std::string number_hint(std::string_view text, bool whole) {
    constexpr std::size_t kLongest = 40;
    if (text.empty() || text.size() > kLongest) return "";
    if (text.ends_with('%')) return whole ? "" : percent_hint(text);
    for (const std::string_view minus : {"\u2212", "\u2013"})
        if (text.starts_with(minus)) return write('-' + std::string(text.substr(minus.size())));
    if (std::string hint = comma_hint(text, whole); !hint.empty()) return hint;
    auto meant = hexadecimal(text);
    const auto product = whole && !text.ends_with('k') ? std::nullopt : factor(text);
    if (!meant && product) meant = plain_number(number_text(*product), whole);
    if (!meant) meant = plain_number(bare(text, whole), whole);
    return meant && *meant != text ? write(*meant) : "";
}

std::string boolean_hint(const Node& node) {
    constexpr std::array<std::string_view, 5> kTrue{"true", "yes", "on", "y", "1"};
    constexpr std::array<std::string_view, 5> kFalse{"false", "no", "off", "n", "0"};
    const std::string word = lower(node.scalar);
    const bool is_true = std::ranges::find(kTrue, word) != kTrue.end();
    const bool is_false = std::ranges::find(kFalse, word) != kFalse.end();
    if (!is_true && !is_false) return "";
    return write(is_true ? "true" : "false") + (node.is_text() ? " without quotes" : "");
}

std::string variable_hint(std::string_view text) {
    const bool percent = text.size() > 2 && text.front() == '%' && text.back() == '%';
    if (!text.starts_with('$') && !percent) return "";
    std::string name;
    for (const char c : text) {
        const bool word = c == '_' || (lower_of(c) >= 'a' && lower_of(c) <= 'z') ||
                          (!name.empty() && kDecimalDigits.find(c) != kDecimalDigits.npos);
        if (word) name += c;
    }
    return write("${" + (name.empty() ? "NAME" : name) + "} for a variable of the environment");
}

std::string origin_hint(const Node& node, std::string_view told) {
    if (node.variable.empty() || told.find("variable") != told.npos) return "";
    return "; it is the value of ${" + node.variable + "}: change the variable, or its default";
}

std::string comment_hint(const Node& node) {
    const std::string_view text = node.scalar;
    const std::size_t sign = std::min(text.find('#'), text.find("//"));
    if (node.quoted || sign == text.npos || sign == 0) return "";
    const std::string_view value = text.substr(0, text.find_last_not_of(' ', sign - 1) + 1);
    const std::string_view comment = trim(text.substr(text.find_first_not_of("#/", sign)));
    return write(std::string(value) + " # " + std::string(comment)) +
           ": a comment begins with a blank and '#'";
}

std::string text_hint(const Node& node, char opening) {
    if (node.kind != Node::Kind::scalar || !node.scalar.starts_with(opening)) return "";
    // Unquoted, it can only come from a variable.
    const std::string each = std::string("write ") +
                             (opening == '[' ? "[${ONE}, ${TWO}]" : "{key: ${NAME}}") +
                             ", a variable for each";
    if (!node.quoted) return "; what a variable brings is one text: " + each;
    return "; in quotes it is one text: leave them out; so it is out of a variable: " + each;
}

std::string none_hint(std::string_view key, std::string_view example, const Node& node) {
    constexpr std::array<std::string_view, 5> kNone{"off", "false", "no", "none", "disabled"};
    const bool says_none = std::ranges::find(kNone, node.scalar) != kNone.end();
    if (!says_none || example.find("off") != example.npos) return "";
    return "; leave " + std::string(key) + " out for none";
}

std::string number_blank_hint(std::string_view key) {
    const std::size_t colon = std::min(key.find(':'), key.size());
    if (!parse_integer(key.substr(0, colon)) || colon + 1 >= key.size()) return "";
    const std::string number(key.substr(0, colon + 1));
    return "; a blank is missing after '" + number + "'" +
           write(number + ' ' + std::string(key.substr(colon + 1)));
}

std::string blank_hint(std::string_view text) {
    if (text.starts_with("<<") && text.find('*') != text.npos)
        return write("<<: " + std::string(text.substr(text.find('*'))));
    if (text.starts_with('(')) return "; the brackets of a map are { and }";
    const std::size_t colon = text.find_first_of(":=");
    const auto is_letter = [](char c) {
        return c == '_' || c == '-' || (lower_of(c) >= 'a' && lower_of(c) <= 'z');
    };
    if (colon == text.npos || colon == 0 || text.substr(colon).starts_with("://")) return "";
    if (!std::ranges::all_of(text.substr(0, colon), is_letter)) return "";
    const std::string key(text.substr(0, colon + 1));
    if (text[colon] == '=')
        return "; write " + std::string(text.substr(0, colon)) + ": " +
               std::string(trim(text.substr(colon + 1)));
    return "; a blank is missing after " + quote(key);
}

}  // namespace panelgate::yaml
