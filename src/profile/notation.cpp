#include "panelgate/profile/notation.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// Suggests what the user meant by an unknown notation, as the end of a message: "; write 400101".
/// Handles plain numbers, reference numbers (40101, 4x101), other vendors' register names (%MW100,
/// HR100, 0x64), inner blanks, and ranges. Empty without a suggestion.
std::string notation_hint(const PanelProfile& profile, std::string_view typed);

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

int hex_digit(char c) {
    if (is_digit(c)) return c - '0';
    const char u = upper(c);
    return u >= 'A' && u <= 'F' ? u - 'A' + 10 : -1;
}

/// Returns the text after the prefix; nullopt if the prefix differs.
std::optional<std::string_view> after_prefix(const Notation& notation, std::string_view text) {
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

/// Returns the item number in `rest`, without a range check.
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
        const auto rest = after_prefix(area.notation, text);
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
        if (same_prefix == nullptr && after_prefix(notation, text)) {
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
    // UB0 is the first bit, not UB00; but UB0A keeps its zero: a number starts with a digit.
    if (area.notation.bit == BitDigits::hex && word == 0 && bit <= 9) digits.erase(0, 1);
    return area.notation.prefix + digits;
}

std::string format_notation(const PanelProfile& profile, modbus::Table table,
                            std::uint16_t address) {
    const Area* area = profile.find_area(table, address);
    return area == nullptr ? std::string() : format_notation(*area, address);
}

namespace {

using modbus::Table;

constexpr std::string_view kDigits = "0123456789";

bool is_number(std::string_view text) {
    return !text.empty() && text.find_first_not_of(kDigits) == text.npos;
}

std::optional<std::uint32_t> parse_number(std::string_view text, int base = 10) {
    std::uint32_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value, base);
    if (text.empty() || error != std::errc() || stop != end) return std::nullopt;
    return value;
}

std::string upper(std::string_view text) {
    std::string all(text);
    std::ranges::transform(all, all.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return all;
}

/// Returns the panel's notation of an item, "" if it has none.
std::string at(const PanelProfile& profile, Table table, std::int64_t address) {
    if (address < 0 || address > 0xFFFF) return "";
    return format_notation(profile, table, static_cast<std::uint16_t>(address));
}

std::string write(const std::string& notation, const std::string& why = {}) {
    return notation.empty() ? "" : "; write " + notation + why;
}

std::optional<Table> table_of_digit(char digit) {
    switch (digit) {
        case '0':
            return Table::coils;
        case '1':
            return Table::discrete_inputs;
        case '3':
            return Table::input_registers;
        case '4':
            return Table::holding_registers;
        default:
            return std::nullopt;
    }
}

struct Word {
    std::string_view word;
    Table table;
};
/// Table names of other programs and vendors; the number after them counts from 0.
constexpr std::array<Word, 16> kWords{{{"HR", Table::holding_registers},
                                       {"HOLDING", Table::holding_registers},
                                       {"HOLDINGREGISTER", Table::holding_registers},
                                       {"HOLDINGREGISTERS", Table::holding_registers},
                                       {"REGISTER", Table::holding_registers},
                                       {"REG", Table::holding_registers},
                                       {"MW", Table::holding_registers},
                                       {"QW", Table::holding_registers},
                                       {"IR", Table::input_registers},
                                       {"INPUT", Table::input_registers},
                                       {"INPUTREGISTER", Table::input_registers},
                                       {"IW", Table::input_registers},
                                       {"COIL", Table::coils},
                                       {"DO", Table::coils},
                                       {"DI", Table::discrete_inputs},
                                       {"DISCRETE", Table::discrete_inputs}}};

/// Returns the letters, digits and dots of a text: "UW 100" and "UW-100" are UW100.
std::string normalised(std::string_view text) {
    std::string all;
    for (const char c : text) {
        if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.') all += c;
    }
    return all;
}

/// 400001-400010
std::string range_hint(const PanelProfile& profile, std::string_view typed) {
    const std::size_t sign = typed.find_first_of("-~:", 1);
    if (sign == typed.npos || sign + 1 == typed.size()) return "";
    const auto first = parse_notation(profile, normalised(typed.substr(0, sign)));
    const auto last = parse_notation(profile, normalised(typed.substr(sign + 1)));
    if (!first || !last || first->area != last->area || last->address < first->address) return "";
    return "; write the first, " + format_notation(*first->area, first->address) +
           ", and how many behind it: count: " + std::to_string(last->address - first->address + 1);
}

/// 40101 and 400101, where 1 is the first item; 4x101.
std::string reference_hint(const PanelProfile& profile, const std::string& typed) {
    std::string text = typed;
    if (text.size() > 2 && text[1] == 'X' && text[0] != '0') text.erase(1, 1);
    const bool crossed = text.size() < typed.size();
    const auto table = table_of_digit(text.empty() ? ' ' : text[0]);
    const auto item =
        parse_number(std::string_view(text).substr(std::min<std::size_t>(1, text.size())));
    const bool sized = crossed || text.size() == 5 || text.size() == 6;
    if (!is_number(text) || !table || !sized || !item || *item == 0) return "";
    return write(at(profile, *table, static_cast<std::int64_t>(*item) - 1));
}

/// 100: an item of an area whose prefix has letters; otherwise a holding register.
std::string number_hint(const PanelProfile& profile, const std::string& text) {
    const auto value = parse_number(text);
    if (!value) return "";
    std::string choice;
    for (const Area& area : profile.areas) {
        if (is_number(area.notation.prefix)) continue;
        const auto item = parse_notation(profile, area.notation.prefix + text);
        if (item && item->area == &area)
            choice += (choice.empty() ? "" : " or ") + area.notation.prefix + text;
    }
    if (!choice.empty()) return write(choice);
    const std::string counted = at(profile, Table::holding_registers, *value);
    const std::string first = at(profile, Table::holding_registers, std::int64_t{*value} - 1);
    if (counted.empty()) return "";
    return "; holding register " + text + " is " + counted + " where the first is 0" +
           (first.empty() ? "" : ", " + first + " where the first is 1");
}

/// %MW100, HR100, holding/100
std::string word_hint(const PanelProfile& profile, const std::string& text) {
    const std::size_t letters = std::min(text.find_first_of(kDigits), text.size());
    const auto word =
        std::ranges::find(kWords, std::string_view(text).substr(0, letters), &Word::word);
    const auto address = parse_number(std::string_view(text).substr(letters));
    if (word == kWords.end() || !address) return "";
    return write(at(profile, word->table, *address), ", where the first is 0");
}

/// 0x64 and 64h
std::string hex_hint(const PanelProfile& profile, std::string_view text) {
    const bool suffixed = text.size() > 1 && text.ends_with('H');
    if (!text.starts_with("0X") && !suffixed) return "";
    const auto address =
        parse_number(suffixed ? text.substr(0, text.size() - 1) : text.substr(2), 16);
    if (!address) return "";
    return write(at(profile, Table::holding_registers, *address),
                 " for holding register " + std::to_string(*address) + ", where the first is 0");
}

}  // namespace

std::string notation_hint(const PanelProfile& profile, std::string_view typed) {
    constexpr std::size_t kLongest = 40;
    if (typed.size() > kLongest) return "";
    if (std::string hint = range_hint(profile, typed); !hint.empty()) return hint;
    const std::string text = upper(normalised(typed));
    if (text != upper(typed)) {
        if (const auto item = parse_notation(profile, text))
            return write(format_notation(*item->area, item->address));
    }
    // 400101.3
    if (const std::size_t dot = text.find('.'); dot != text.npos) {
        const auto item = parse_notation(profile, text.substr(0, dot));
        if (item && is_number(text.substr(dot + 1)))
            return write(format_notation(*item->area, item->address),
                         ", and bit: " + text.substr(dot + 1) + " for one of its bits");
    }
    for (const auto& hint : {reference_hint(profile, text), hex_hint(profile, text),
                             word_hint(profile, text), number_hint(profile, text)}) {
        if (!hint.empty()) return hint;
    }
    return "";
}

}  // namespace panelgate::profile
