#include <algorithm>
#include <array>
#include <cstdint>

#include "hints.hpp"
#include "load_stations.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/yaml/document.hpp"
#include "point_limits.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using points::Point;
using points::Type;
using yaml::MapReader;
using yaml::Node;

using Fits = bool (*)(Type);

std::vector<std::string_view> words_of(Fits fits) {
    std::vector<std::string_view> words;
    for (const Type type : points::kTypes)
        if (fits(type)) words.push_back(label(type));
    return words;
}

bool is_number(Type type) { return type != Type::boolean && type != Type::string; }
bool is_of_registers(Type type) { return type != Type::boolean; }

/// Keys that are not for all types.
struct OfTypes {
    std::vector<std::string_view> keys;
    Fits fits;
    std::string_view what;  ///< what they are for
    std::vector<std::string_view> types = words_of(fits);
};

/// Reports keys that are not for the point's type.
void check_type(MapReader& in, const Point& point) {
    static const std::array<OfTypes, 3> kOfTypes{
        {{{"word_order"}, is_of_registers, "values of registers"},
         {{"scale", "offset", "min", "max", "no_value"}, is_number, "numbers"},
         {{"labels"}, points::is_integer, "integers"}}};
    for (const OfTypes& of : kOfTypes) {
        for (const std::string_view key : of.keys) {
            in.belongs(key, "type", of.types, true);
            if (in.has(key) && !of.fits(point.type))
                in.problem(key, std::string(key) + (key.ends_with('s') ? " are for " : " is for ") +
                                    std::string(of.what) + ", not for type " +
                                    std::string(label(point.type)));
        }
    }
}

/// float32be, uint32_le
std::string order_hint(std::string_view typed) {
    const bool ordered = typed.ends_with("be") || typed.ends_with("le");
    const bool number = typed.find_first_of("0123456789") != typed.npos;
    return ordered && number ? " The order of its bytes is word_order" : "";
}

void load_type(MapReader& in, Point& point) {
    const bool bits = modbus::is_bit_table(point.table);
    const auto bit = in.integer("bit", 0, 15);
    if (bit && bits) in.problem("bit", point.at + " is a bit already; remove bit");
    if (bit && !bits) point.bit = static_cast<unsigned>(*bit);
    point.type = bits || point.bit ? Type::boolean : Type::u16;
    static const std::vector<std::string_view> kWords = words_of([](Type) { return true; });
    if (const auto chosen = in.choice_index("type", kWords, order_hint)) {
        const Type type = points::kTypes[*chosen];
        if (point.type == Type::boolean && type != Type::boolean) {
            in.problem("type", point.at + (bits ? " is a bit" : " with bit: is one bit") +
                                   ": its type is bool, not " + std::string(label(type)));
        } else if (point.type != Type::boolean && type == Type::boolean) {
            in.problem("type", point.at + " is a register: give bit: 0 to 15 for one of its bits");
        } else {
            point.type = type;
        }
    }
    const auto length = in.integer("length", 1, 250);
    const std::array<std::string_view, 1> string{label(Type::string)};
    in.belongs("length", "type", string);
    if (in.lacks("type", label(Type::string), "length") && point.type == Type::string)
        in.problem("type", "a string needs its length: add length: 1 to 250 characters");
    if (point.type != Type::string && length)
        in.problem("length", "length is for type: string only");
    if (point.type == Type::string) point.length = static_cast<unsigned>(length.value_or(1));
    point_keys().read(in, point);
    check_type(in, point);
}

/// Reads a number; more digits than a double holds are a problem.
double exact_number(MapReader& in, std::string_view key, double otherwise) {
    const auto number = in.number(key);
    const Node* written = in.child(key);
    if (!number || written == nullptr) return number.value_or(otherwise);
    const auto exact = Decimal::parse(written->scalar);
    if (exact && *exact != Decimal(*number))
        in.problem(key, std::string(key) + " has more digits than are reckoned with, " +
                            yaml::quote(written->scalar) + "; write " + number_text(*number));
    return *number;
}

void load_scale(MapReader& in, Point& point) {
    point.scale = exact_number(in, "scale", 1);
    in.schema("scale").never = 0;
    point.offset = exact_number(in, "offset", 0);
    if (point.scale == 0) {
        in.problem("scale", "scale must not be 0");
        point.scale = 1;
    }
    load_limits(in, point);
}

constexpr std::string_view kPollExample = "{read: UW100, count: 8, every: 1s}";

void load_label(MapReader& in, const yaml::Entry& entry, Point& point) {
    const auto raw = yaml::parse_integer(entry.key);
    const bool is_text = entry.value.kind == Node::Kind::scalar && !entry.value.comma;
    if (!raw || !is_text || entry.value.scalar.empty()) {
        const bool is_null = raw && entry.value.kind == Node::Kind::null;
        in.problems().add(
            entry.mark,
            is_null ? "a label must be a text, not nothing; for the word null write 'null' in "
                      "quotes: " +
                          entry.key + ": 'null'"
                    : "labels are RAW-NUMBER: text, such as 1: running");
        return;
    }
    if (const RawRange range = label_range(point.type); !range.contains(*raw)) {
        in.problems().add(entry.mark, "a label of type " + std::string(label(point.type)) +
                                          " is for a raw number from " + range.text() + ", not " +
                                          entry.key);
    }
    for (const auto& [other, text] : point.labels) {
        if (text != entry.value.scalar) continue;
        in.problems().add(entry.value.mark, "two labels '" + text + "': of " +
                                                std::to_string(other) + " and of " + entry.key +
                                                "; a write could mean either");
    }
    point.labels[*raw] = entry.value.scalar;
}

/// Returns [stopped, running] as a map.
std::string labels_example(const Node* typed) {
    constexpr std::size_t kMost = 8;
    if (typed == nullptr || typed->items.empty() || typed->items.size() > kMost)
        return "{0: stopped, 1: running}";
    std::string map;
    for (std::size_t i = 0; i < typed->items.size(); ++i)
        map += (i > 0 ? ", " : "") + std::to_string(i) + ": " + typed->items[i].scalar;
    return '{' + map + '}';
}

void load_labels(MapReader& in, Point& point) {
    const Node* labels = in.map("labels", labels_example(in.child("labels")));
    in.schema("labels").keys = yaml::kIntegerPattern;
    if (labels == nullptr || !is_integer(point.type)) return;
    if (labels->entries.size() > points::kMaxLabels) {
        in.problem("labels", "at most " + std::to_string(points::kMaxLabels) +
                                 " labels of one point, not " +
                                 std::to_string(labels->entries.size()));
        return;
    }
    for (const yaml::Entry& entry : labels->entries) load_label(in, entry, point);
}

void load_no_value(MapReader& in, Point& point) {
    const auto list = in.entries("no_value", {}, points::kMaxNoValues, "values that mean none");
    in.schema("no_value").holds_integers = true;
    if (!is_number(point.type)) return;
    const RawRange range = no_value_range(point.type);
    for (const Node& item : list) {
        const bool plain = item.kind == Node::Kind::scalar && !item.is_text();
        const auto raw = plain ? yaml::parse_integer(item.scalar) : std::nullopt;
        if (!raw) {
            in.problems().add(item.mark, "no_value is a list of raw numbers, such as [-32768]");
        } else if (!range.contains(*raw)) {
            in.problems().add(item.mark, "no_value of type " + std::string(label(point.type)) +
                                             " must be from " + range.text() + ", not " +
                                             item.scalar);
        } else {
            point.no_value.push_back(*raw);
        }
    }
}

/// The whole value must be readable on the panel, and writable if the point is.
void check_area(MapReader& in, const Point& point, const profile::Area& area,
                const profile::PanelProfile& profile) {
    const std::uint32_t count = point.count();
    if (!area.readable.contains(point.address, count)) {
        in.problem("at", std::to_string(count) + " registers from " + point.at +
                             " reach beyond the end of " + area.name + ", " +
                             format_notation(area, static_cast<std::uint16_t>(area.readable.last)));
    }
    // In two reads, one half could be older than the other.
    if (point.type == Type::string) check_read_count(in, "length", profile, point.table, count);
    if (!point.writable) return;
    if (!area.writable) {
        in.problem("writable", point.at + " cannot be written (" + area.source + ')');
    } else if (!area.writable->contains(point.address, count)) {
        in.problem("writable",
                   point.at + " cannot be written: " + area.name + " takes writes from " +
                       format_notation(area, static_cast<std::uint16_t>(area.writable->first)) +
                       " to " +
                       format_notation(area, static_cast<std::uint16_t>(area.writable->last)));
    } else if (const auto why = points::why_unwritable(profile, point)) {
        in.problem("writable", *why);
    }
}

constexpr std::string_view kNameLetters = "abcdefghijklmnopqrstuvwxyz0123456789_-";

bool is_point_name(std::string_view text) {
    return !text.empty() && text.find_first_not_of(kNameLetters) == std::string_view::npos;
}

/// Reads the unit; empty if a variable is empty.
std::string load_unit(MapReader& in) {
    const Node* typed = in.child("unit");
    if (typed != nullptr && !typed->variable.empty() && typed->scalar.empty()) return "";
    return in.text("unit").value_or("");
}

/// Reports `temperature: UW100` in place of a point.
bool refuse_short_form(Loading& loading, const Node& node) {
    if (node.entries.size() != 1 || node.entries[0].value.kind != Node::Kind::scalar) return false;
    const auto& [name, mark, at] = node.entries[0];
    const std::vector<std::string_view> keys = point_keys().names();
    const bool is_key = std::ranges::find(keys, name) != keys.end();
    if (is_key || at.scalar.find_first_of("0123456789") == at.scalar.npos) return false;
    loading.problems.add(node.mark, "a point must be a map of name and at; write {name: " +
                                        (is_point_name(name) ? name : "NAME") +
                                        ", at: " + at.scalar + '}');
    return true;
}

constexpr const char* kListens =
    "the line is only listened to (mode: listen): nothing can be written there; leave writable out";

void load_point(Loading& loading, const Node& node, Station& station, Firsts& names) {
    if (refuse_short_form(loading, node)) return;
    MapReader in(node, loading.problems, "a point", "{name: temperature, at: UW100}");
    Point point;
    point.name = in.required_text("name").value_or("");
    static const std::string kPattern = pattern_of(kNameLetters);
    in.looks_like("name", kPattern, true);
    if (!point.name.empty() && !is_point_name(point.name))
        in.problem("name", "name must be of a-z, 0-9, '-' and '_', not " + yaml::quote(point.name) +
                               name_hint(point.name));
    if (!point.name.empty())
        names.once(in, "name", point.name,
                   "there are two points '" + point.name + "' of this station");
    const auto item = load_notation(in, "at", *station.profile);
    point.at = in.text("at").value_or("");
    if (item) {
        point.table = item->area->table;
        point.address = item->address;
    }
    load_type(in, point);
    load_scale(in, point);
    point.unit = load_unit(in);
    if (point.writable && station.read_only)
        in.problem("writable", "station '" + station.name +
                                   "' is read_only; give it access: read_write, or leave writable "
                                   "out");
    if (point.writable && station.listens) in.problem("writable", kListens);
    load_labels(in, point);
    load_no_value(in, point);
    if (item) check_area(in, point, *item->area, *station.profile);
    warn_of_unused_keys(loading, in, point);
    in.finish();
    if (item) station.points.push_back(std::move(point));
}

void load_poll(Loading& loading, const Node& node, Station& station) {
    MapReader in(node, loading.problems, "a poll", kPollExample);
    points::Poll poll;
    const auto item = load_notation(in, "read", *station.profile);
    poll.read = in.text("read").value_or("");
    poll_keys().read(in, poll);
    if (item) {
        poll.table = item->area->table;
        poll.address = item->address;
        const profile::Area& area = *item->area;
        if (!area.readable.contains(poll.address, poll.count)) {
            in.problem("count",
                       std::to_string(poll.count) + " from " + poll.read +
                           " reach beyond the end of " + area.name + ", " +
                           format_notation(area, static_cast<std::uint16_t>(area.readable.last)));
        }
        check_read_count(in, "count", *station.profile, poll.table, poll.count);
    }
    in.finish();
    if (item) station.polls.push_back(std::move(poll));
}

}  // namespace

std::optional<profile::Item> load_notation(MapReader& in, std::string_view key,
                                           const profile::PanelProfile& profile) {
    const auto text = in.required_text(key);
    if (!text) return std::nullopt;
    const auto item = profile::parse_notation(profile, *text);
    if (item) return *item;
    in.problem(key, item.error().message);
    return std::nullopt;
}

void check_read_count(MapReader& in, std::string_view key, const profile::PanelProfile& profile,
                      modbus::Table table, std::uint32_t count) {
    const unsigned most = profile.max_count(modbus::read_function(table));
    if (count <= most) return;
    in.problem(key, profile.name + " gives at most " + std::to_string(most) +
                        (modbus::is_bit_table(table) ? " bits" : " registers") +
                        " in one read, not " + std::to_string(count));
}

void load_points(Loading& loading, MapReader& in, Station& station) {
    if (station.listens && in.child("poll") != nullptr) {
        in.problem("poll",
                   "the line is only listened to (mode: listen): nothing is asked there; write "
                   "points, which what passes by fills");
    }
    for (const Node& node : in.entries("poll", "[{read: UW100, count: 8, every: 1s}]",
                                       points::kMaxPolls, "poll of one station"))
        load_poll(loading, node, station);
    Firsts names;
    for (const Node& node : in.entries("points", "[{name: temperature, at: UW100}]",
                                       points::kMaxPoints, "points of one station"))
        load_point(loading, node, station, names);
}

}  // namespace panelgate::config
