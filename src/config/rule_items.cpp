// The items that a rule of `access` is about.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/profile/judge.hpp"
#include "panelgate/profile/notation.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using access::Place;
using access::Rule;
using modbus::Span;
using yaml::Node;

constexpr Words<modbus::Table, 4> kTableWords{
    {{"coils", modbus::Table::coils},
     {"discrete-inputs", modbus::Table::discrete_inputs},
     {"input-registers", modbus::Table::input_registers},
     {"holding-registers", modbus::Table::holding_registers}}};

std::optional<Span> intersection(const Span& items, const profile::AddressRange& range) {
    const std::uint32_t first = std::max(items.first, range.first);
    const std::uint32_t end = std::min(items.end(), range.last + 1);
    if (first >= end) return std::nullopt;
    return Span{items.table, first, end - first};
}

void append(std::vector<Span>& to, const std::vector<Span>& more) {
    for (const Span& span : more) {
        if (std::ranges::find(to, span) == to.end()) to.push_back(span);
    }
}

void append_in_all_tables(std::vector<Span>& to, const profile::Area& area, const Span& items) {
    append(to, {{area.table, items.first, items.count}});
    for (const modbus::Table table : area.also) append(to, {{table, items.first, items.count}});
}

/// Returns the words that hold the bits. `wholly`: only words whose bits are all among `bits`.
std::optional<Span> words_of(const Span& bits, bool wholly) {
    constexpr std::uint32_t kBits = profile::kBitsPerWord;
    const std::uint32_t first = (bits.first + (wholly ? kBits - 1 : 0)) / kBits;
    const std::uint32_t end = (bits.end() + (wholly ? 0 : kBits - 1)) / kBits;
    if (first >= end) return std::nullopt;
    return Span{bits.table, first, end - first};
}

/// Returns the items and the places that show the same memory. `wholly`: only places that show no
/// other memory.
std::vector<Span> shown(const profile::PanelProfile& profile, const Span& items, bool wholly) {
    std::vector<Span> all{items};
    for (const profile::Area& area : profile.areas) {
        if (!area.reaches(items.table)) continue;
        const auto part = intersection(items, area.readable);
        if (!part) continue;
        if (area.view_of.empty()) {
            append(all, profile::shown_as(profile, *part));
            continue;
        }
        append_in_all_tables(all, area, *part);
        const profile::Area& words = *profile.find_area(std::string_view(area.view_of));
        if (const auto seen = words_of(*part, wholly)) append_in_all_tables(all, words, *seen);
    }
    return all;
}

/// GDT100-GDT199, or one item.
struct Typed {
    std::string first;
    std::string last;
};

Typed typed_range(const std::string& text) {
    const std::size_t slash = text.find('/');  // tables have a '-' in their names
    const std::size_t dash = text.find('-', slash == text.npos ? 0 : slash);
    if (dash == text.npos) return {text, text};
    const auto trimmed = [](std::string part) {
        part.erase(0, part.find_first_not_of(' '));
        part.erase(part.find_last_not_of(' ') + 1);
        return part;
    };
    return {trimmed(text.substr(0, dash)), trimmed(text.substr(dash + 1))};
}

/// GDT100..GDT199, with other signs than the '-' of the keyboard.
std::string other_range(const profile::PanelProfile& profile, const std::string& text) {
    for (const std::string_view sign : {"\u2013", "\u2014", "...", "..", " to ", "~"}) {
        const std::size_t at = text.find(sign);
        if (at == text.npos) continue;
        const auto [first, last] =
            typed_range(text.substr(0, at) + '-' + text.substr(at + sign.size()));
        if (profile::parse_notation(profile, first) && profile::parse_notation(profile, last))
            return "a range has a '-' of the keyboard; write " + first + '-' + last;
    }
    return "";
}

/// Returns the items of a rule at a station; `why` receives the fault of the items, if any.
std::optional<Span> named_items(const profile::PanelProfile& profile, const Typed& typed,
                                std::string& why) {
    const auto first = profile::parse_notation(profile, typed.first);
    const auto last = profile::parse_notation(profile, typed.last);
    if (!first || !last) {
        why = other_range(profile, typed.first);
        if (why.empty()) why = (first ? last : first).error().message;
        return std::nullopt;
    }
    if (first->area != last->area || first->address > last->address) {
        why = "range goes from the first to the last item of one area, such as UW100-UW199";
        return std::nullopt;
    }
    return Span{first->area->table, first->address,
                static_cast<std::uint32_t>(last->address - first->address) + 1};
}

bool is_meant(const Rule& rule, const Place& place) {
    return rule.stations.empty() || std::ranges::find(rule.stations, place) != rule.stations.end();
}

void add_items(Rule& rule, const Place& place, const profile::PanelProfile& profile,
               const Span& items) {
    rule.items[place] = rule.allow ? shown(profile, items, true) : shown(profile, items, false);
}

/// "holding-registers/100-109", as the map of the same is shown.
std::optional<Span> items_of_table(const Typed& typed) {
    const std::size_t slash = typed.first.find('/');
    if (slash == std::string::npos) return std::nullopt;
    const auto word = std::ranges::find(kTableWords, typed.first.substr(0, slash),
                                        &decltype(kTableWords)::value_type::first);
    const bool is_one = typed.first == typed.last;
    const auto first = yaml::parse_integer(typed.first.substr(slash + 1));
    const auto last = is_one ? first : yaml::parse_integer(typed.last);
    if (word == kTableWords.end() || !first || !last || *first < 0 || *last < *first ||
        *last >= modbus::kTableItems)
        return std::nullopt;
    return Span{word->second, static_cast<std::uint32_t>(*first),
                static_cast<std::uint32_t>(*last - *first) + 1};
}

void add_everywhere(const Config& config, const Span& items, Rule& rule) {
    rule.unlisted_items = items;
    rule.range = std::string(label(items.table)) + '/' + std::to_string(items.first);
    if (items.count > 1) rule.range += '-' + std::to_string(items.end() - 1);
    for (const Line& line : config.lines) {
        for (const Station& station : line.stations) {
            const Place place{line.name, station.id};
            if (is_meant(rule, place)) add_items(rule, place, *station.profile, items);
        }
    }
}

void find_items(Reader& in, const std::string& text, Rule& rule) {
    const Typed typed = typed_range(text);
    if (const auto items = items_of_table(typed))
        return add_everywhere(in.loading.config, *items, rule);
    std::string wrong;
    for (const Line& line : in.loading.config.lines) {
        for (const Station& station : line.stations) {
            const Place place{line.name, station.id};
            if (!is_meant(rule, place)) continue;
            std::string why;
            if (const auto items = named_items(*station.profile, typed, why)) {
                add_items(rule, place, *station.profile, *items);
            } else if (wrong.empty()) {
                wrong = "at station '" + station.name + "': " + why;
            }
        }
    }
    const bool all = rule.items.size() >= rule.stations.size();
    if (!rule.items.empty() && all) return;
    if (wrong.empty())
        wrong =
            "a notation needs listed stations, whose panels are known; write "
            "range: {table: holding-registers, address: 100, count: 10}";
    if (!in.loading.names_missing) in.problem("range", wrong);
}

/// `range` as a map.
struct TableRange {
    std::optional<modbus::Table> table;
    std::int64_t address = 0;
    std::int64_t count = 1;
};

const Keys<TableRange>& table_range_keys() {
    static const auto kKeys =
        Keys<TableRange>()
            .value(words_shape("table", names_of(kTableWords), "Table of the items."),
                   [](Reader& in, TableRange& range) {
                       range.table = in.choice<modbus::Table>("table", kTableWords);
                       return range.table.has_value();
                   },
                   {})
            .required()
            .example("holding-registers")
            .integer("address", &TableRange::address, 0, modbus::kTableItems - 1,
                     "Address of the first, from 0.")
            .required()
            .example("0")
            .integer("count", &TableRange::count, 1, modbus::kTableItems, "How many.")
            .example("500");
    return kKeys;
}

}  // namespace

const Table& table_range_table() { return table_range_keys(); }

bool read_range(Reader& in, Rule& rule) {
    const Node* node = in.child("range");
    if (node == nullptr || node->kind != Node::Kind::map) {
        const auto text = in.text("range");
        if (!text) return false;
        rule.range = *text;
        find_items(in, *text, rule);
        return true;
    }
    Reader own(in.loading, *node, "range");
    TableRange range;
    const Given given = table_range_keys().read(own, range);
    own.finish();
    if (!given.has("address") || !range.table) return false;
    Span items{*range.table, static_cast<std::uint32_t>(range.address),
               static_cast<std::uint32_t>(range.count)};
    items.count = std::min(items.count, modbus::kTableItems - items.first);
    add_everywhere(in.loading.config, items, rule);
    return true;
}

}  // namespace panelgate::config
