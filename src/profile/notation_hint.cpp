#include "notation_hint.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/profile/notation.hpp"

namespace panelgate::profile {
namespace {

using modbus::Table;

constexpr std::string_view kDigits = "0123456789";

bool is_number(std::string_view text) {
    return !text.empty() && text.find_first_not_of(kDigits) == text.npos;
}

std::optional<std::uint32_t> number(std::string_view text, int base = 10) {
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

/// How the panel writes an item, "" when it has none there.
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
/// Other programs' and makers' words for the tables; the number behind them counts from 0.
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

/// Letters, digits and dots of a text: "UW 100" and "UW-100" are UW100.
std::string squeezed(std::string_view text) {
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
    const auto first = parse_notation(profile, squeezed(typed.substr(0, sign)));
    const auto last = parse_notation(profile, squeezed(typed.substr(sign + 1)));
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
    const auto item = number(std::string_view(text).substr(std::min<std::size_t>(1, text.size())));
    const bool sized = crossed || text.size() == 5 || text.size() == 6;
    if (!is_number(text) || !table || !sized || !item || *item == 0) return "";
    return write(at(profile, *table, static_cast<std::int64_t>(*item) - 1));
}

/// 100: of areas with letters, the one that it is a number of; else a holding register.
std::string number_hint(const PanelProfile& profile, const std::string& text) {
    const auto value = number(text);
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
    const auto address = number(std::string_view(text).substr(letters));
    if (word == kWords.end() || !address) return "";
    return write(at(profile, word->table, *address), ", where the first is 0");
}

/// 0x64 and 64h
std::string hex_hint(const PanelProfile& profile, std::string_view text) {
    const bool suffixed = text.size() > 1 && text.ends_with('H');
    if (!text.starts_with("0X") && !suffixed) return "";
    const auto address = number(suffixed ? text.substr(0, text.size() - 1) : text.substr(2), 16);
    if (!address) return "";
    return write(at(profile, Table::holding_registers, *address),
                 " for holding register " + std::to_string(*address) + ", where the first is 0");
}

}  // namespace

std::string notation_hint(const PanelProfile& profile, std::string_view typed) {
    constexpr std::size_t kLongest = 40;
    if (typed.size() > kLongest) return "";
    if (std::string hint = range_hint(profile, typed); !hint.empty()) return hint;
    const std::string text = upper(squeezed(typed));
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
