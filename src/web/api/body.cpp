#include "body.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <cmath>
#include <optional>
#include <utility>

#include "json_reader.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/web/api/value_json.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "repeated_member.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// "line 2, column 5"
std::string place_of(std::string_view body, std::size_t at) {
    const std::string_view before = body.substr(0, std::min(at, body.size()));
    const auto line = 1 + std::ranges::count(before, '\n');
    const auto line_start = before.rfind('\n');
    const auto column = before.size() - (line_start == before.npos ? 0 : line_start + 1) + 1;
    return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

Problem bad_json(std::string_view body, const JsonFault& fault) {
    const char* const kind = fault.is_json ? "a number that cannot be: " : "the body is not JSON: ";
    return problem(400, kind + place_of(body, fault.at) + ": " + fault.what);
}

/// The number when it is whole and fits; JSON has no integers of its own.
std::optional<std::int64_t> as_whole(const json::value& value) {
    if (value.is_int64()) return value.get_int64();
    if (!value.is_double()) return std::nullopt;
    const double number = value.get_double();
    if (number != std::floor(number) || std::abs(number) > 1e15) return std::nullopt;
    return static_cast<std::int64_t>(number);
}

Parsed<std::uint16_t> cell(const json::value& value, modbus::Table table) {
    if (modbus::is_bit_table(table)) {
        if (value.is_bool()) return static_cast<std::uint16_t>(value.get_bool() ? 1 : 0);
        const auto bit = as_whole(value);
        if (bit && (*bit == 0 || *bit == 1)) return static_cast<std::uint16_t>(*bit);
        return problem(400, "a bit is true, false, 1 or 0, not " + excerpt(json_text(value)));
    }
    const auto number = as_whole(value);
    if (number && *number >= -32768 && *number <= 65535) {
        return static_cast<std::uint16_t>(*number & 0xFFFF);
    }
    return problem(400, "a register is a whole number from 0 to 65535, or from -32768, not " +
                            excerpt(json_text(value)));
}

}  // namespace

Parsed<json::value> parse_json(std::string_view text) {
    JsonRead read = read_json(text);
    if (read.fault) return bad_json(text, *read.fault);
    if (const auto twice = find_repeated_member(text))
        return problem(400, "the member '" + excerpt(twice->name) +
                                "' comes a second time: " + place_of(text, twice->at));
    return std::move(read.value);
}

Parsed<json::object> parse_object(std::string_view body) {
    const auto value = parse_json(body);
    if (!value) return value.error();
    if (!value->is_object()) return problem(400, "the body must be a JSON object");
    return value->get_object();
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

Parsed<std::int64_t> whole_number(const json::value& value, std::string_view name, std::int64_t low,
                                  std::int64_t high) {
    const auto number = as_whole(value);
    if (number && *number >= low && *number <= high) return *number;
    return problem(400, std::string(name) + " must be a whole number from " + std::to_string(low) +
                            " to " + std::to_string(high) + ", not " + excerpt(json_text(value)));
}

Parsed<std::int64_t> number_member(const json::object& object, std::string_view name,
                                   std::int64_t low, std::int64_t high) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return problem(400, "the body lacks " + std::string(name));
    return whole_number(*member, name, low, high);
}

Parsed<std::string> string_member(const json::object& object, std::string_view name) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return problem(400, "the body lacks " + std::string(name));
    if (!member->is_string() || exact_digits(*member))
        return problem(400, std::string(name) + " must be a string");
    return std::string(member->get_string());
}

Parsed<json::array> values_member(const json::object& object) {
    const json::value* const one = object.if_contains("value");
    const json::value* const several = object.if_contains("values");
    if (one != nullptr && several != nullptr)
        return problem(400, R"(the body has "value" for one or "values" for several, not both)");
    if (one != nullptr) return json::array{*one};
    if (several == nullptr || !several->is_array() || several->get_array().empty()) {
        return problem(400, R"(the body must be {"values": [...]} with at least one value)");
    }
    return several->get_array();
}

Parsed<std::vector<std::uint16_t>> values_member(const json::object& object, modbus::Table table) {
    const auto values = values_member(object);
    if (!values) return values.error();
    std::vector<std::uint16_t> cells;
    for (const json::value& value : *values) {
        const auto parsed = cell(value, table);
        if (!parsed) return parsed.error();
        cells.push_back(*parsed);
    }
    return cells;
}

Parsed<bool> flag_member(const json::object& object, std::string_view name) {
    const json::value* member = object.if_contains(name);
    if (member == nullptr) return false;
    if (member->is_bool()) return member->get_bool();
    return problem(
        400, std::string(name) + " must be true or false, not " + excerpt(json_text(*member)));
}

Parsed<points::Value> value_member(const json::object& object) {
    const json::value* value = object.if_contains("value");
    if (value == nullptr) return problem(400, "the body needs \"value\"");
    return value_of(*value);
}

Parsed<points::Value> value_of(const json::value& value) {
    if (value.is_bool()) return points::Value(value.get_bool());
    if (value.is_int64()) return points::Value(value.get_int64());
    if (value.is_uint64()) return points::Value(value.get_uint64());
    if (value.is_double()) return points::Value(value.get_double());
    if (const auto digits = exact_digits(value)) return points::Value(*Decimal::parse(*digits));
    if (value.is_string()) return points::Value(std::string(value.get_string()));
    return problem(400, "value must be a number, true, false or a text");
}

}  // namespace panelgate::web
