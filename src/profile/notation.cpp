#include "panelgate/profile/notation.hpp"

#include <charconv>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "notation_hint.hpp"

namespace panelgate::profile {
namespace {

constexpr unsigned kBitsPerWord = 16;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

int hex_digit(char c) {
    if (is_digit(c)) return c - '0';
    const char u = upper(c);
    return u >= 'A' && u <= 'F' ? u - 'A' + 10 : -1;
}

/// What stands behind the prefix, or nothing when the text has another prefix.
std::optional<std::string_view> behind_prefix(const Notation& notation, std::string_view text) {
    if (text.size() <= notation.prefix.size()) return std::nullopt;
    for (std::size_t i = 0; i < notation.prefix.size(); ++i) {
        if (upper(text[i]) != upper(notation.prefix[i])) return std::nullopt;
    }
    const std::string_view rest = text.substr(notation.prefix.size());
    return is_digit(rest[0]) ? std::optional(rest) : std::nullopt;
}

std::optional<std::uint64_t> decimal(std::string_view text) {
    constexpr std::size_t kMostDigits = 12;
    std::uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || text.size() > kMostDigits || error != std::errc() || stop != end)
        return std::nullopt;
    return value;
}

/// The item number that `rest` writes, before any range is looked at.
std::optional<std::uint64_t> item_number(const Notation& notation, std::string_view rest) {
    switch (notation.bit) {
        case BitDigits::none: {
            const bool fits = notation.digits == 0 || rest.size() == notation.digits ||
                              (notation.short_digits != 0 && rest.size() == notation.short_digits);
            const auto number = decimal(rest);
            if (!fits || !number || *number < notation.base) return std::nullopt;
            return *number - notation.base;
        }
        case BitDigits::hex: {
            const int bit = hex_digit(rest.back());
            // A single digit is a bit of word 0: UB0 is the first bit.
            const auto word = rest.size() == 1 ? std::optional<std::uint64_t>(0)
                                               : decimal(rest.substr(0, rest.size() - 1));
            if (bit < 0 || !word) return std::nullopt;
            return *word * kBitsPerWord + static_cast<unsigned>(bit);
        }
        case BitDigits::decimal: {
            const std::size_t dot = rest.find('.');
            if (dot == std::string_view::npos || rest.size() - dot - 1 != 2) return std::nullopt;
            const auto word = decimal(rest.substr(0, dot));
            const auto bit = decimal(rest.substr(dot + 1));
            if (!word || !bit || *bit >= kBitsPerWord) return std::nullopt;
            return *word * kBitsPerWord + *bit;
        }
    }
    return std::nullopt;
}

std::string range_text(const Area& area) {
    return format_notation(area, static_cast<std::uint16_t>(area.readable.first)) + " to " +
           format_notation(area, static_cast<std::uint16_t>(area.readable.last));
}

NotationError out_of_range(std::string_view text, const PanelProfile& profile,
                           const Notation& notation) {
    std::string ranges;
    for (const Area& area : profile.areas) {
        if (area.notation.prefix != notation.prefix) continue;
        ranges += (ranges.empty() ? "" : " and ") + range_text(area);
    }
    return {NotationError::Kind::out_of_range,
            std::string(text) + " is outside " + ranges + " of " + profile.name};
}

NotationError not_known(std::string_view text, const PanelProfile& profile) {
    std::string examples;
    for (const Area& area : profile.areas) {
        const std::string example =
            format_notation(area, static_cast<std::uint16_t>(area.readable.first));
        examples += (examples.empty() ? "" : ", ") + example;
    }
    return {NotationError::Kind::unknown, '\'' + std::string(text) + "' is no notation of " +
                                              profile.name + "; its notations look like " +
                                              examples + notation_hint(profile, text)};
}

NotationError malformed(std::string_view text, const PanelProfile& profile, const Area& area) {
    return {NotationError::Kind::malformed, '\'' + std::string(text) + "' is not written as " +
                                                area.name + " is: " + range_text(area) +
                                                notation_hint(profile, text)};
}

}  // namespace

void throw_exception_from_error(const NotationError& error, const boost::source_location&) {
    throw std::logic_error(error.message);
}

boost::system::result<Item, NotationError> parse_notation(const PanelProfile& profile,
                                                          std::string_view text) {
    const Area* same_prefix = nullptr;
    bool read = false;
    for (const Area& area : profile.areas) {
        const auto rest = behind_prefix(area.notation, text);
        if (!rest) continue;
        same_prefix = &area;
        const auto number = item_number(area.notation, *rest);
        if (!number) continue;
        read = true;
        if (*number <= 0xFFFF && area.readable.contains(static_cast<std::uint32_t>(*number))) {
            return Item{&area, static_cast<std::uint16_t>(*number)};
        }
    }
    for (const Unreachable& hint : profile.unreachable) {
        const Notation notation{hint.prefix};
        if (same_prefix == nullptr && behind_prefix(notation, text)) {
            return NotationError{NotationError::Kind::unknown,
                                 std::string(text) + ": " + hint.reason};
        }
    }
    if (same_prefix == nullptr) return not_known(text, profile);
    if (!read) return malformed(text, profile, *same_prefix);
    return out_of_range(text, profile, same_prefix->notation);
}

std::string format_notation(const Area& area, std::uint16_t address) {
    char text[16] = {};
    const unsigned word = address / kBitsPerWord;
    const unsigned bit = address % kBitsPerWord;
    switch (area.notation.bit) {
        case BitDigits::none:
            std::snprintf(text, sizeof text, "%0*u", static_cast<int>(area.notation.digits),
                          address + area.notation.base);
            break;
        case BitDigits::hex:
            std::snprintf(text, sizeof text, "%u%X", word, bit);
            break;
        case BitDigits::decimal:
            std::snprintf(text, sizeof text, "%u.%02u", word, bit);
            break;
    }
    std::string digits = text;
    // UB0 is the first bit, not UB00; but UB0A keeps its zero, a number starts with a digit.
    if (area.notation.bit == BitDigits::hex && word == 0 && bit <= 9) digits.erase(0, 1);
    return area.notation.prefix + digits;
}

std::string format_notation(const PanelProfile& profile, modbus::Table table,
                            std::uint16_t address) {
    const Area* area = profile.find_area(table, address);
    return area == nullptr ? std::string() : format_notation(*area, address);
}

}  // namespace panelgate::profile
