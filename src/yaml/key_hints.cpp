#include "key_hints.hpp"

#include <algorithm>
#include <cctype>

#include "encoding.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

}  // namespace

bool is_word(std::string_view text) {
    if (text.empty()) return false;
    for (const char c : text) {
        const bool letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
        if (!letter && c != '_' && c != '-') return false;
    }
    return std::isalpha(static_cast<unsigned char>(text[0])) != 0;
}

std::optional<Finding> missing_colon(const Scanned& text, std::size_t token) {
    const Token& line = text.tokens[token];
    const std::string_view word = text.text(line);
    if (line.kind != Kind::plain) return std::nullopt;
    if (word.starts_with("//") || word.starts_with("/*") || word.starts_with(';') ||
        word.starts_with("-- "))
        return Finding{line.begin, "a comment begins with '#'"};
    const std::size_t end = std::min(word.find_first_of(":= \t\xEF"), word.size());
    const std::string_view key = word.substr(0, end);
    const std::string_view rest = word.substr(end);
    if (!is_word(key) && key != "<<") return std::nullopt;
    constexpr std::string_view kWide = "\xEF\xBC\x9A";  // U+FF1A, as Asian keyboards type it
    const auto shown = [&](std::string_view value) {
        value.remove_prefix(std::min(value.find_first_not_of(" \t:="), value.size()));
        return "write '" + std::string(key) + (value.empty() ? ":" : ": ") +
               std::string(clip(value, 60)) + '\'';
    };
    if (rest.starts_with(kWide))
        return Finding{line.begin + end, "U+FF1A is no colon; " + shown(rest.substr(3))};
    if (rest.starts_with("://")) return std::nullopt;
    if (rest.starts_with(':'))
        return Finding{line.begin + end + 1, "a blank is missing after '" + std::string(key) +
                                                 ":'; " + shown(rest.substr(1))};
    const std::size_t sign = std::min(rest.find_first_not_of(" \t"), rest.size());
    if (rest.substr(sign).starts_with('='))
        return Finding{line.begin + end + sign,
                       "a key is followed by ':', not '='; " + shown(rest)};
    return Finding{line.begin + end,
                   "a ':' is missing after '" + std::string(key) + "'; " + shown(rest)};
}

std::string second_colon(const Scanned& text, std::size_t key, std::size_t value) {
    const std::string name(clip(text.text(text.tokens[key]), 60));
    const std::string_view word = text.text(text.tokens[value]);
    const std::string all(clip(text.rest(value), 60));
    if (const std::string address = address_hint(word, all); !address.empty()) return address;
    const std::string_view last = word.substr(word.find_last_of(" \t") + 1);
    const std::string quotes = "; one text that holds ': ' must stand in quotes: \"" + all + '"';
    if (is_word(word))
        return "two keys on one line; begin a deeper line for '" + std::string(word) +
               "', or write " + name + ": {" + all + '}' + quotes;
    if (is_word(last))
        return "two keys on one line; begin a new line for '" + std::string(last) + '\'' + quotes;
    return "a text that holds ': ' must stand in quotes; write \"" + all +
           "\", or begin a new line for a second key";
}

}  // namespace panelgate::yaml
