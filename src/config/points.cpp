// Points and polls: rows of the table, and checks against the memory of the panel.

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/notation.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using points::Point;
using points::Type;
using yaml::Node;

constexpr std::string_view kPointLetters = "abcdefghijklmnopqrstuvwxyz0123456789_-";

bool is_point_name(std::string_view text) {
    return !text.empty() && text.find_first_not_of(kPointLetters) == std::string_view::npos;
}

std::string point_name_fault(std::string_view typed) {
    if (is_point_name(typed)) return "";
    return "name must be of a-z, 0-9, '-' and '_', not " + yaml::quote(typed) + name_hint(typed);
}

using Fits = bool (*)(Type);
bool is_number(Type type) { return type != Type::boolean && type != Type::string; }
bool is_of_registers(Type type) { return type != Type::boolean; }

/// The words of the types.
std::vector<std::string> words_of(Fits fits) {
    std::vector<std::string> words;
    for (const Type type : points::kTypes)
        if (fits(type)) words.emplace_back(label(type));
    return words;
}

const Words<Type, std::size(points::kTypes)>& type_words() {
    static const auto kWords = [] {
        Words<Type, std::size(points::kTypes)> words{};
        for (std::size_t i = 0; i < words.size(); ++i)
            words[i] = {label(points::kTypes[i]), points::kTypes[i]};
        return words;
    }();
    return kWords;
}

/// float32be, uint32_le
std::string order_hint(std::string_view typed) {
    const bool ordered = typed.ends_with("be") || typed.ends_with("le");
    const bool number = typed.find_first_of("0123456789") != typed.npos;
    return ordered && number ? " The order of its bytes is word_order" : "";
}

/// Empty if a variable is.
bool read_unit(Reader& in, Point& point) {
    const Node* typed = in.child("unit");
    if (typed != nullptr && !typed->variable.empty() && typed->scalar.empty())
        return in.has("unit");
    const auto unit = in.text("unit");
    point.unit = unit.value_or("");
    return unit.has_value();
}

bool read_labels(Reader& in, Point& point);
bool read_no_value(Reader& in, Point& point);

}  // namespace

const Keys<Point>& point_keys() {
    static constexpr Words<points::WordOrder, 4> kOrders{{{"ABCD", points::kOrders[0]},
                                                          {"BADC", points::kOrders[1]},
                                                          {"CDAB", points::kOrders[2]},
                                                          {"DCBA", points::kOrders[3]}}};
    const auto numbers = words_of(is_number);
    const std::string string(label(Type::string));
    constexpr std::string_view kNumbers = "is for numbers";
    KeyShape labels =
        shape_of("labels", Kind::map, "Texts of raw integers, such as {0: off, 1: on}.");
    labels.keys = yaml::kIntegerPattern;
    KeyShape no_value =
        shape_of("no_value", Kind::list, "Raw numbers that mean that there is no value.");
    no_value.holds_integers = true;
    no_value.most_entries = points::kMaxNoValues;
    static const auto kKeys =
        Keys<Point>()
            .text("name", &Point::name, {pattern_of(kPointLetters), true, 0, point_name_fault},
                  "Name of a-z, 0-9, '-' and '_', unique in its station.")
            .required()
            .example("temperature")
            .value(
                shape_of("at", Kind::text,
                         "Register or bit in the panel's notation, such as UW100 or 400001."),
                [](Reader& in, Point& point) {
                    return read_place(in, "at", point.at, point.table, point.address);
                },
                [](const Point& point) { return point.at; })
            .weaker(By::any)
            .required()
            .example("UW100")
            .integer("bit", &Point::bit, 0, 15, "One bit of a register; the type is bool then.")
            .weaker(By::any)
            .word("type", &Point::type, type_words(),
                  "Type of the value. Without it u16; of a bit bool.", order_hint)
            .weaker(By::any)
            .needs("string", "length", "string needs its length: add length: 1 to 250 characters")
            .initially("")
            .example("i16")
            .integer("length", &Point::length, 1, 250, "Characters of a string, two in a register.")
            .weaker(By::any)
            .shown_if([](const Point& point) { return point.type == Type::string; })
            .initially("")
            .only_with("type", {string}, "is for type: string only")
            .word("word_order", &Point::word_order, kOrders,
                  "Order of the bytes of values in registers, not of bits; ABCD: high word first.")
            .weaker(By::any)
            .only_with("type", words_of(is_of_registers), "is for values of registers", true)
            .number("scale", &Point::scale,
                    "Factor of a number: value = raw * scale + offset; not 0.")
            .weaker(By::any)
            .in_schema([](KeyShape& shape) { shape.never = 0; })
            .example("0.1")
            .only_with("type", numbers, kNumbers, true)
            .number("offset", &Point::offset, "Offset of a number: value = raw * scale + offset.")
            .weaker(By::any)
            .only_with("type", numbers, kNumbers, true)
            .value(shape_of("unit", Kind::text, "Unit, as people write it."), read_unit,
                   [](const Point& point) { return point.unit; })
            .example("celsius")
            .number("min", &Point::min, "Smallest number that may be written.")
            .weaker(By::falling)
            .only_with("type", numbers, kNumbers, true)
            .number("max", &Point::max, "Largest number that may be written.")
            .weaker(By::growing)
            .only_with("type", numbers, kNumbers, true)
            .boolean("writable", &Point::writable, "Clients may write it.")
            .weaker(By::coming, "true")
            .below(labels, {}, read_labels,
                   [](const SettingWriter& out, const Point& point, const SettingWriter*) {
                       for (const auto& [raw, text] : point.labels)
                           out.below("labels").put(std::to_string(raw), text);
                   })
            .example("{0: off, 1: on}")
            .only_with("type", words_of(points::is_integer), "are for integers", true)
            .value(no_value, read_no_value,
                   [](const Point& point) { return as_written(point.no_value); })
            .example("[-32768]")
            .only_with("type", numbers, kNumbers, true)
            .duration("every", &Point::every, 1ms, points::kSlowest, "Interval between two reads.")
            .map(
                "report", &Point::report, report_keys, "{deadband: 0.5, at_least: 60s}",
                "When MQTT, Sparkplug and events tell a value; without it each change, events each "
                "read.",
                check_report)
            .boolean("overview", &Point::overview,
                     "Its value stands on its station's tile; without one the first point's.");
    return kKeys;
}

namespace {

/// Raw numbers of an integer type, as far as a signed 64-bit integer holds them.
struct RawRange {
    std::int64_t low = 0;
    std::int64_t high = 0;
    bool contains(std::int64_t raw) const { return raw >= low && raw <= high; }
    std::string text() const { return std::to_string(low) + " to " + std::to_string(high); }
};

RawRange signed_range(unsigned bits) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    const std::int64_t high = bits >= 64 ? kMost : (std::int64_t{1} << (bits - 1)) - 1;
    return {-high - 1, high};
}

RawRange unsigned_range(unsigned bits) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    return {0, bits >= 63 ? kMost : (std::int64_t{1} << bits) - 1};
}

/// Range for labels; unlimited for other than integer types.
RawRange label_range(Type type) {
    if (type == Type::bcd16) return {0, 9'999};
    if (type == Type::bcd32) return {0, 99'999'999};
    if (!is_integer(type)) return signed_range(64);
    const unsigned bits = points::bits_of(type);
    return points::is_signed(type) ? signed_range(bits) : unsigned_range(bits);
}

/// Range for no_value: 65535 and -1 are the same register.
RawRange no_value_range(Type type) {
    RawRange range = label_range(type);
    const bool is_bcd = type == Type::bcd16 || type == Type::bcd32;
    if (!is_integer(type) || is_bcd) return range;
    range.low = signed_range(points::bits_of(type)).low;
    range.high = unsigned_range(points::bits_of(type)).high;
    return range;
}

/// The range of the scaled value.
struct ValueRange {
    double low = 0;
    double high = 0;
    bool contains(double value) const { return value >= low && value <= high; }
    std::string text() const { return shown(low) + " to " + shown(high); }

    /// Formats 3276.7, though 32767 * 0.1 is a little more.
    static std::string shown(double value) {
        std::array<char, 32> digits{};
        const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                                std::chars_format::general, 15);
        double rounded = value;
        if (error == std::errc()) std::from_chars(digits.data(), end, rounded);
        return number_text(rounded);
    }
};

ValueRange value_range(const Point& point) {
    const auto value = [&](double raw) { return raw * point.scale + point.offset; };
    double low = 0;
    double high = 0;
    if (point.type == Type::f64) {
        high = std::numeric_limits<double>::max();
        low = -high;
        return {low, high};
    }
    if (is_float(point.type)) {
        high = point.type == Type::f16 ? 65504 : as_printed(std::numeric_limits<float>::max());
        low = -high;
    } else {
        const RawRange range = label_range(point.type);
        low = static_cast<double>(range.low);
        // A RawRange has signed 64 bits, which cannot hold all of a u64.
        high = point.type == Type::u64 ? 0x1p64 : static_cast<double>(range.high);
    }
    const auto [least, most] = std::minmax({value(low), value(high)});
    return {least, most};
}

void check_limit(Reader& in, std::string_view key, const Point& point,
                 std::optional<Decimal>& limit) {
    const ValueRange range = value_range(point);
    // Tolerates rounding: 6553.5 is 65535 * 0.1, whatever its last bit.
    const double slack = std::max(std::abs(range.low), std::abs(range.high)) * 1e-12;
    if (!limit || ValueRange{range.low - slack, range.high + slack}.contains(limit->nearest()))
        return;
    std::string type(label(point.type));
    if (point.scale != 1) type += " with scale " + number_text(point.scale);
    if (point.offset != 0)
        type += (point.scale != 1 ? " and offset " : " with offset ") + number_text(point.offset);
    in.problem(key, std::string(key) + " must be a value that the point can have, " + range.text() +
                        " (" + type + "), not " + limit->text());
    limit.reset();
}

/// True if a whole raw number is between them: with scale 10, 0 and 10 are, but none of 1 to 9.
bool has_value_between(const Point& point, double min, double max) {
    const auto raw = [&](double value) { return (value - point.offset) / point.scale; };
    const auto [low, high] = std::minmax({raw(min), raw(max)});
    const double slack = std::max({1.0, std::abs(low), std::abs(high)}) * 1e-9;
    return std::ceil(low - slack) <= std::floor(high + slack);
}

/// Both limits must be values that the point can have.
void check_limits(Reader& in, Point& point) {
    if (point.min && point.max && *point.min > *point.max)
        in.problem("min", "min is above max: nothing could be written");
    if (point.type == Type::boolean || point.type == Type::string) return;
    check_limit(in, "min", point, point.min);
    check_limit(in, "max", point, point.max);
    if (is_integer(point.type) && point.min && point.max && *point.min <= *point.max &&
        !has_value_between(point, point.min->nearest(), point.max->nearest()))
        in.problem("min", "the point has no value from " + point.min->text() + " to " +
                              point.max->text() + " (scale " + number_text(point.scale) +
                              "): nothing could be written");
}

void read_label(Reader& in, const yaml::Entry& entry, Point& point) {
    const auto raw = yaml::parse_integer(entry.key);
    const bool is_text = entry.value.kind == Node::Kind::scalar && !entry.value.comma;
    const auto refuse = [&](yaml::Mark mark, std::string why) {
        in.problems().add(mark, std::move(why));
    };
    if (!raw || !is_text || entry.value.scalar.empty())
        return refuse(entry.mark, raw && entry.value.kind == Node::Kind::null
                                      ? "a label must be a text, not nothing; for the word null "
                                        "write 'null' in quotes: " +
                                            entry.key + ": 'null'"
                                      : "labels are RAW-NUMBER: text, such as 1: running");
    if (const RawRange range = label_range(point.type); !range.contains(*raw))
        refuse(entry.mark, "a label of type " + std::string(label(point.type)) +
                               " is for a raw number from " + range.text() + ", not " + entry.key);
    for (const auto& [other, text] : point.labels)
        if (text == entry.value.scalar)
            refuse(entry.value.mark, "two labels '" + text + "': of " + std::to_string(other) +
                                         " and of " + entry.key + "; a write could mean either");
    point.labels[*raw] = entry.value.scalar;
}

bool read_labels(Reader& in, Point& point) {
    const Node* labels = in.map("labels", "{0: stopped, 1: running}");
    if (labels == nullptr || !is_integer(point.type)) return false;
    if (labels->entries.size() > points::kMaxLabels) {
        in.problem("labels", "at most " + std::to_string(points::kMaxLabels) +
                                 " labels of one point, not " +
                                 std::to_string(labels->entries.size()));
        return false;
    }
    for (const yaml::Entry& entry : labels->entries) read_label(in, entry, point);
    return true;
}

/// A whole number, also 0x8000 as the manuals have it.
std::optional<std::int64_t> parse_raw(std::string_view text) {
    if (!text.starts_with("0x")) return yaml::parse_integer(text);
    std::uint64_t value = 0;
    const auto [end, error] =
        std::from_chars(text.data() + 2, text.data() + text.size(), value, 16);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole ? std::optional(static_cast<std::int64_t>(value)) : std::nullopt;
}

bool read_no_value(Reader& in, Point& point) {
    const auto list = in.entries("no_value", {}, points::kMaxNoValues);
    if (!is_number(point.type)) return false;
    const RawRange range = no_value_range(point.type);
    for (const Node& item : list) {
        const bool plain = item.kind == Node::Kind::scalar && !item.is_text();
        const auto raw = plain ? parse_raw(item.scalar) : std::nullopt;
        if (!raw) {
            in.problems().add(item.mark,
                              "no_value is a list of raw numbers, such as [-32768] or [0x8000]");
        } else if (!range.contains(*raw)) {
            in.problems().add(item.mark, "no_value of type " + std::string(label(point.type)) +
                                             " must be from " + range.text() + ", not " +
                                             item.scalar);
        } else {
            point.no_value.push_back(*raw);
        }
    }
    return !list.empty();
}

/// Bits and registers have other types.
void check_type(Reader& in, Point& point, const Given& given) {
    const bool bits = modbus::is_bit_table(point.table);
    if (point.bit && bits) {
        in.problem("bit", point.at + " is a bit already; remove bit");
        point.bit.reset();
    }
    const bool is_bit = bits || point.bit;
    if (!given.has("type") && is_bit) point.type = Type::boolean;
    if (is_bit && point.type != Type::boolean)
        in.problem("type", point.at + (bits ? " is a bit" : " with bit: is one bit") +
                               ": its type is bool, not " + std::string(label(point.type)));
    if (!is_bit && point.type == Type::boolean)
        in.problem("type", point.at + " is a register: give bit: 0 to 15 for one of its bits");
    for (const std::string_view key :
         {"word_order", "scale", "offset", "min", "max", "labels", "no_value"})
        if (!in.has("type") && is_bit && in.has(key))
            in.problem(key, std::string(key) + " is not for a bit, whose type is bool");
    if (point.report.deadband && !is_number(point.type))
        in.problem("report", "deadband is for numbers, and " + point.name + " is of type " +
                                 std::string(label(point.type)));
    if (point.type != Type::string) point.length = 0;
}

/// Two registers of a value may be turned; strings keep their order.
void warn_of_order(Reader& in, const Point& point) {
    const bool turns = points::registers_of(point.type) > 1 && point.type != Type::string;
    if (point.type == Type::boolean || turns || point.word_order != points::WordOrder::cdab) return;
    const std::string why = point.type == Type::string
                                ? "a string keeps the order of its words"
                                : std::string(label(point.type)) + " is one word";
    in.warn("word_order", "word_order: CDAB has no effect: " + why +
                              "; leave it out, or write BADC to turn the bytes of each word");
}

void warn_of_limits(Reader& in, const Point& point) {
    if (point.writable || (!point.min && !point.max)) return;
    const std::string key = point.min ? "min" : "max";
    const std::string keys = point.min && point.max ? "min and max" : key;
    in.warn(key, keys + (keys == key ? " has" : " have") +
                     " no effect: what is written is limited, and the point is not writable; add "
                     "writable: true, or leave " +
                     keys + " out");
}

/// The whole value must be readable on the panel, and writable if the point is.
void check_area(Reader& in, const Point& point, const profile::Area& area,
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

void check_rights(Reader& in, const Point& point, const Station& station) {
    if (!point.writable) return;
    if (station.read_only)
        in.problem("writable", "station '" + station.name +
                                   "' is read_only; give it access: read_write, or leave writable "
                                   "out");
    if (station.listens)
        in.problem("writable",
                   "the line is only listened to (mode: listen): nothing can be written there; "
                   "leave writable out");
}

/// Reports `temperature: UW100` in place of a point.
bool refuse_short_form(Reader& owner, const Node& node) {
    if (node.entries.size() != 1 || node.entries[0].value.kind != Node::Kind::scalar) return false;
    const auto& [name, mark, at] = node.entries[0];
    const std::vector<std::string_view> keys = point_keys().names();
    const bool is_key = std::ranges::find(keys, name) != keys.end();
    if (is_key || at.scalar.find_first_of("0123456789") == at.scalar.npos) return false;
    owner.problems().add(node.mark, "a point must be a map of name and at; write {name: " +
                                        (is_point_name(name) ? name : "NAME") +
                                        ", at: " + at.scalar + '}');
    return true;
}

}  // namespace

std::optional<Point> load_point(Reader& owner, const Node& node) {
    if (refuse_short_form(owner, node)) return std::nullopt;
    const Station& station = *owner.loading.station;
    Reader in(owner.loading, node, "a point", "{name: temperature, at: UW100}");
    Point point;
    const Given given = point_keys().read(in, point);
    if (given.has("name"))
        owner.loading.points.once(in, "name", point.name,
                                  "there are two points '" + point.name + "' of this station");
    if (point.scale == 0) {
        in.problem("scale", "scale must not be 0");
        point.scale = 1;
    }
    check_type(in, point, given);
    check_limits(in, point);
    check_rights(in, point, station);
    warn_of_limits(in, point);
    warn_of_order(in, point);
    in.finish();
    if (!given.has("at")) return std::nullopt;
    check_area(in, point, *profile::parse_notation(*station.profile, point.at)->area,
               *station.profile);
    return point;
}

}  // namespace panelgate::config
