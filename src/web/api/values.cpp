#include "panelgate/web/api/values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "panelgate/base/decimal.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

constexpr unsigned kMaxText = 240;  ///< characters of a string

/// The value as an integer if it is whole and fits; JSON does not distinguish integers.
std::optional<std::int64_t> as_whole(const json::value& value) {
    if (value.is_int64()) return value.get_int64();
    if (!value.is_double()) return std::nullopt;
    const double number = value.get_double();
    if (number != std::floor(number) || std::abs(number) > 1e15) return std::nullopt;
    return static_cast<std::int64_t>(number);
}

bool is_text(const json::value& value) { return value.is_string() && !exact_digits(value); }

Problem lacking(std::string_view name) {
    return problem(400, "the body lacks " + std::string(name));
}

}  // namespace

Parsed<json::object> parse_object(std::string_view body) {
    auto value = parse_json(body);
    if (!value) return value.error();
    if (!value->is_object()) return problem(400, "the body must be a JSON object");
    return std::move(value->get_object());
}

Parsed<json::object> parse_object(std::string_view body, Members known) {
    auto object = parse_object(body);
    if (!object) return object;
    for (const auto& [name, value] : *object) {
        if (std::ranges::find(known, std::string_view(name)) == known.end())
            return unknown_name("member", name, {known.begin(), known.size()});
    }
    return object;
}

Parsed<std::int64_t> number_member(const json::object& object, std::string_view name,
                                   std::int64_t low, std::int64_t high) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return lacking(name);
    const auto number = as_whole(*member);
    if (number && *number >= low && *number <= high) return *number;
    return problem(400, std::string(name) + " must be a whole number from " + std::to_string(low) +
                            " to " + std::to_string(high) + ", not " + excerpt(json_text(*member)));
}

Parsed<std::string> string_member(const json::object& object, std::string_view name) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return lacking(name);
    if (is_text(*member)) return std::string(member->get_string());
    return problem(400, std::string(name) + " must be a string");
}

Parsed<bool> flag_member(const json::object& object, std::string_view name) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return false;
    if (member->is_bool()) return member->get_bool();
    return problem(
        400, std::string(name) + " must be true or false, not " + excerpt(json_text(*member)));
}

namespace {

struct Maker {
    json::value operator()(const auto& value) const { return json::value(value); }
    json::value operator()(const Decimal& value) const { return exact_number(value.text()); }
};

}  // namespace

json::value json_of(const points::Value& value) { return std::visit(Maker(), value); }

Parsed<points::Value> value_of(const json::value& value) {
    if (value.is_bool()) return points::Value(value.get_bool());
    if (value.is_int64()) return points::Value(value.get_int64());
    if (value.is_uint64()) return points::Value(value.get_uint64());
    if (value.is_double()) return points::Value(value.get_double());
    if (const auto digits = exact_digits(value)) return points::Value(*Decimal::parse(*digits));
    if (value.is_string()) return points::Value(std::string(value.get_string()));
    return problem(400, "value must be a number, true, false or a text");
}

Parsed<points::Value> value_member(const json::object& object) {
    const json::value* value = object.if_contains("value");
    if (value == nullptr) return problem(400, "the body needs \"value\"");
    return value_of(*value);
}

namespace {

std::optional<std::string> query(const HttpRequest& request, const char* name) {
    const auto given = request.query.find(name);
    if (given == request.query.end()) return std::nullopt;
    return given->second;
}

Parsed<unsigned> count_member(const json::object& object, std::string_view name, unsigned most) {
    if (!object.contains(name)) return 1u;
    const auto number = number_member(object, name, 1, most);
    if (!number) return number.error();
    return static_cast<unsigned>(*number);
}

Parsed<std::optional<std::string>> text_member(const json::object& object, std::string_view name) {
    if (!object.contains(name)) return std::optional<std::string>();
    auto text = string_member(object, name);
    if (!text) return text.error();
    return std::optional<std::string>(std::move(*text));
}

/// The value with this label; otherwise 400 with the list of all labels.
template <class Word, std::size_t N>
Parsed<Word> word_of(const char* what, const std::string& text, const Word (&all)[N]) {
    std::string known;
    for (const Word word : all) {
        if (text == label(word)) return word;
        known += (known.empty() ? "" : ", ") + std::string(label(word));
    }
    return problem(
        400, "there is no " + std::string(what) + " '" + excerpt(text) + "'; there are " + known);
}

Parsed<points::Type> type_of(const ValueFormat& format, bool bits) {
    if (!format.type) return bits ? points::Type::boolean : points::Type::u16;
    const auto type = word_of("type", *format.type, points::kTypes);
    if (type && bits && *type != points::Type::boolean)
        return problem(400, "the type of a bit is bool, not " + *format.type);
    return type;
}

}  // namespace

Parsed<ValueFormat> format_of(const HttpRequest& request) {
    ValueFormat format;
    format.type = query(request, "type");
    format.order = query(request, "order");
    if (query(request, "length")) {
        const auto length = query_number(request, "length", 1, kMaxText, 1);
        if (!length) return length.error();
        format.length = *length;
    }
    const auto raw = query_flag(request, "raw");
    if (!raw) return raw.error();
    format.raw = *raw;
    return format;
}

Parsed<ValueFormat> format_of(const json::object& object) {
    ValueFormat format;
    auto type = text_member(object, "type");
    if (!type) return type.error();
    format.type = std::move(*type);
    auto order = text_member(object, "order");
    if (!order) return order.error();
    format.order = std::move(*order);
    const auto length = count_member(object, "length", kMaxText);
    if (!length) return length.error();
    if (object.contains("length")) format.length = *length;
    const auto count = count_member(object, "count", modbus::kTableItems);
    if (!count) return count.error();
    format.count = *count;
    const auto raw = flag_member(object, "raw");
    if (!raw) return raw.error();
    format.raw = *raw;
    return format;
}

Parsed<View> view_of(const ValueFormat& format, modbus::Table table) {
    View view;
    const bool bits = modbus::is_bit_table(table);
    view.raw = format.raw;
    view.value.table = table;
    const auto type = type_of(format, bits);
    if (!type) return type.error();
    view.value.type = *type;
    if (format.order) {
        if (bits) return problem(400, "a bit has no order");
        const auto order = word_of("order", *format.order, points::kOrders);
        if (!order) return order.error();
        view.value.word_order = *order;
    }
    const bool text = *type == points::Type::string;
    if (format.length && !text) return problem(400, "only a string has a length");
    if (text && !format.length) {
        // One string over all registers.
        view.value.length = 2 * format.count;
        view.items = format.count;
        return view;
    }
    view.value.length = format.length.value_or(0);
    view.items = format.count * view.value.count();
    return view;
}

json::array values_of(const View& view, std::span<const std::uint16_t> items) {
    json::array values;
    const std::size_t step = view.value.count();
    for (std::size_t at = 0; at + step <= items.size(); at += step) {
        const auto value = points::decode(view.value, items.subspan(at, step));
        values.push_back(value ? json_of(*value) : json::value(nullptr));
    }
    return values;
}

namespace {

/// The member "values" with at least one value, or the member "value" in its place.
Parsed<json::array> values_member(const json::object& object) {
    const json::value* const one = object.if_contains("value");
    const json::value* const several = object.if_contains("values");
    if (one != nullptr && several != nullptr)
        return problem(400, R"(the body has "value" for one or "values" for several, not both)");
    if (one != nullptr) return json::array{*one};
    if (several == nullptr || !several->is_array() || several->get_array().empty())
        return problem(400, R"(the body must be {"values": [...]} with at least one value)");
    return several->get_array();
}

Parsed<std::uint16_t> cell(const json::value& value, modbus::Table table) {
    const auto number = as_whole(value);
    if (modbus::is_bit_table(table)) {
        if (value.is_bool()) return static_cast<std::uint16_t>(value.get_bool() ? 1 : 0);
        if (number && (*number == 0 || *number == 1)) return static_cast<std::uint16_t>(*number);
        return problem(400, "a bit is true, false, 1 or 0, not " + excerpt(json_text(value)));
    }
    if (number && *number >= -32768 && *number <= 65535)
        return static_cast<std::uint16_t>(*number & 0xFFFF);
    return problem(400, "a register is a whole number from 0 to 65535, or from -32768, not " +
                            excerpt(json_text(value)));
}

/// The registers of one value of a type. `at`: its place in the body, for messages.
Parsed<std::vector<std::uint16_t>> typed_cells(points::Point type, bool has_length, std::string at,
                                               const json::value& given) {
    const auto value = value_of(given);
    if (!value) return value.error();
    if (points::is_byte(type.type))
        return problem(422, std::string(label(type.type)) +
                                " is half a register, and a write would change the other half; a "
                                "point of this type is written by function 22");
    type.name = std::move(at);
    const auto* text = std::get_if<std::string>(&*value);
    if (text != nullptr && !has_length)
        type.length = static_cast<unsigned>(text->size() + text->size() % 2);
    auto registers = points::encode(type, *value);
    if (!registers) return problem_of(registers.error(), "");
    return std::move(*registers);
}

}  // namespace

Parsed<std::vector<std::uint16_t>> cells_of(const json::object& body, modbus::Table table) {
    const bool is_typed =
        std::ranges::any_of(std::array{"type", "order", "length"},
                            [&](const char* name) { return body.contains(name); });
    View view;
    if (is_typed) {
        const auto format = format_of(body);
        if (!format) return format.error();
        auto wanted = view_of(*format, table);
        if (!wanted) return wanted.error();
        view = std::move(*wanted);
    }
    const auto values = values_member(body);
    if (!values) return values.error();
    std::vector<std::uint16_t> cells;
    for (std::size_t i = 0; i < values->size(); ++i) {
        if (!is_typed) {
            const auto one = cell((*values)[i], table);
            if (!one) return one.error();
            cells.push_back(*one);
            continue;
        }
        const std::string at =
            body.contains("value") ? "value" : "values[" + std::to_string(i) + ']';
        const auto some = typed_cells(view.value, body.contains("length"), at, (*values)[i]);
        if (!some) return some.error();
        cells.insert(cells.end(), some->begin(), some->end());
    }
    return cells;
}

Problem problem_of(const points::WriteRefusal& refusal, const char* more) {
    if (refusal.malformed) return problem(400, refusal.message);
    return problem(422, refusal.message + (refusal.inexact ? more : ""), "outside-limits");
}

}  // namespace panelgate::web
