#include "panelgate/web/http/json_text.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>
#include <cstddef>

#include "panelgate/base/text.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr char kExactNumber = '\xFF';  ///< prefix of the digits; never in UTF-8

void append(std::string& text, const json::value& value);

/// Fast path: most texts need no escape, and a trace has thousands of them.
void append(std::string& text, json::string_view words) {
    const bool plain = std::ranges::none_of(words, [](char c) {
        return static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\';
    });
    if (!plain) {
        text += json::serialize(words);
        return;
    }
    text += '"';
    text += words;
    text += '"';
}

void append(std::string& text, const json::array& array) {
    text += '[';
    bool first = true;
    for (const json::value& value : array) {
        if (!first) text += ',';
        first = false;
        append(text, value);
    }
    text += ']';
}

void append(std::string& text, const json::object& object) {
    text += '{';
    bool first = true;
    for (const auto& [name, value] : object) {
        if (!first) text += ',';
        first = false;
        append(text, name);
        text += ':';
        append(text, value);
    }
    text += '}';
}

/// Recursion is bounded: parsed values have a depth limit, those made here are flat.
void append(std::string& text, const json::value& value) {
    if (const json::array* array = value.if_array()) return append(text, *array);
    if (const json::object* object = value.if_object()) return append(text, *object);
    if (const auto digits = exact_digits(value)) {
        text += *digits;
        return;
    }
    if (const json::string* words = value.if_string())
        return append(text, json::string_view(*words));
    const double* number = value.if_double();
    if (number == nullptr) {
        text += json::serialize(value);
        return;
    }
    const std::string digits = number_text(*number);
    text += digits.empty() ? "null" : digits;
}

}  // namespace

std::string json_text(const json::value& value) {
    std::string text;
    append(text, value);
    return text;
}

json::value exact_number(std::string_view digits) {
    return json::value(kExactNumber + std::string(digits));
}

std::optional<std::string_view> exact_digits(const json::value& value) {
    const json::string* words = value.if_string();
    if (words == nullptr || words->empty() || words->front() != kExactNumber) return std::nullopt;
    return std::string_view(*words).substr(1);
}

std::string excerpt(std::string text) {
    constexpr std::size_t kMost = 80;
    if (text.size() <= kMost) return text;
    std::size_t end = kMost;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    return text.substr(0, end) + "...";
}

}  // namespace panelgate::web
