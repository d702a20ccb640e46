#include "body.hpp"

#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/error.hpp>
#include <boost/json/string_view.hpp>
#include <boost/json/value.hpp>
#include <boost/json/value_stack.hpp>
#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/web/api/point_order.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

/// A handler for boost::json::basic_parser that accepts everything. Derived handlers hide the
/// members that they need.
struct JsonHandler {
    using error_code = boost::system::error_code;
    using View = boost::json::string_view;

    static constexpr std::size_t max_object_size = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t max_array_size = max_object_size;
    static constexpr std::size_t max_key_size = max_object_size;
    static constexpr std::size_t max_string_size = max_object_size;

    bool on_document_begin(error_code&) { return true; }
    bool on_document_end(error_code&) { return true; }
    bool on_object_begin(error_code&) { return true; }
    bool on_object_end(std::size_t, error_code&) { return true; }
    bool on_array_begin(error_code&) { return true; }
    bool on_array_end(std::size_t, error_code&) { return true; }
    bool on_key_part(View, std::size_t, error_code&) { return true; }
    bool on_key(View, std::size_t, error_code&) { return true; }
    bool on_string_part(View, std::size_t, error_code&) { return true; }
    bool on_string(View, std::size_t, error_code&) { return true; }
    bool on_number_part(View, error_code&) { return true; }
    bool on_int64(std::int64_t, View, error_code&) { return true; }
    bool on_uint64(std::uint64_t, View, error_code&) { return true; }
    bool on_double(double, View, error_code&) { return true; }
    bool on_bool(bool, error_code&) { return true; }
    bool on_null(error_code&) { return true; }
    bool on_comment_part(View, error_code&) { return true; }
    bool on_comment(View, error_code&) { return true; }
};

/// Why a text is not a valid value, and where.
struct JsonFault {
    std::size_t at = 0;  ///< in the text
    std::string what;
    bool is_json = false;  ///< valid JSON, but with a number that cannot be represented
};

struct JsonRead {
    boost::json::value value;
    std::optional<JsonFault> fault;
};

/// Parses JSON and keeps numbers exact: whole ones become 64-bit integers where they fit, 9e18 and
/// 9007199254740993.0 included; others become doubles, or exact_number() where a double has too few
/// digits. A number beyond the range of a double, or one that would become 0, is a fault.
JsonRead read_json(std::string_view text);

namespace {

using boost::system::error_code;

/// Collects the member names of each open object; their number is not limited. The parser limits
/// the depth.
class Names : public JsonHandler {
  public:
    bool on_object_begin(error_code&) {
        open_.emplace_back();
        return true;
    }
    bool on_object_end(std::size_t, error_code&) {
        open_.pop_back();
        return true;
    }
    bool on_key_part(View part, std::size_t, error_code&) {
        name_ += part;
        return true;
    }
    bool on_key(View part, std::size_t, error_code& error) {
        name_ += part;
        const auto [place, is_new] = open_.back().insert(std::exchange(name_, {}));
        if (is_new) return true;
        repeated = *place;
        error = boost::system::errc::make_error_code(boost::system::errc::invalid_argument);
        return false;
    }

    /// The name that ended the parsing.
    std::optional<std::string> repeated;

  private:
    std::vector<std::set<std::string>> open_;
    std::string name_;
};

}  // namespace

std::optional<RepeatedMember> find_repeated_member(std::string_view json) {
    boost::json::basic_parser<Names> parser{boost::json::parse_options()};
    error_code error;
    const std::size_t used = parser.write_some(false, json.data(), json.size(), error);
    auto& name = parser.handler().repeated;
    if (!name) return std::nullopt;
    // An escaped name is longer in the text: then the position is that of its end.
    const std::string quoted = '"' + *name;
    const std::size_t begin = used - std::min(used, quoted.size());
    const bool plain = json.substr(begin, quoted.size()) == quoted;
    return RepeatedMember{std::move(*name), plain ? begin : used};
}

namespace {

std::optional<double> double_of(const std::string& text) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// Builds the value like boost::json's own handler, except for numbers.
class Builder : public JsonHandler {
  public:
    bool on_document_begin(error_code&) {
        stack_.reset();
        return true;
    }
    bool on_object_end(std::size_t count, error_code&) {
        stack_.push_object(count);
        return true;
    }
    bool on_array_end(std::size_t count, error_code&) {
        stack_.push_array(count);
        return true;
    }
    bool on_key_part(View part, std::size_t, error_code&) {
        stack_.push_chars(part);
        return true;
    }
    bool on_key(View part, std::size_t, error_code&) {
        stack_.push_key(part);
        return true;
    }
    bool on_string_part(View part, std::size_t, error_code&) {
        stack_.push_chars(part);
        return true;
    }
    bool on_string(View part, std::size_t, error_code&) {
        stack_.push_string(part);
        return true;
    }
    bool on_number_part(View part, error_code&) {
        number_ += part;
        return true;
    }
    bool on_int64(std::int64_t, View part, error_code& error) { return on_number(part, error); }
    bool on_uint64(std::uint64_t, View part, error_code& error) { return on_number(part, error); }
    bool on_double(double, View part, error_code& error) { return on_number(part, error); }
    bool on_bool(bool value, error_code&) {
        stack_.push_bool(value);
        return true;
    }
    bool on_null(error_code&) {
        stack_.push_null();
        return true;
    }

    boost::json::value release() { return stack_.release(); }

    /// The number that ended the parsing.
    std::optional<std::string> beyond;

  private:
    bool on_number(View part, error_code& error) {
        number_ += part;
        const std::string text = std::exchange(number_, {});
        if (push(text)) return true;
        beyond = text;
        error = boost::system::errc::make_error_code(boost::system::errc::result_out_of_range);
        return false;
    }
    bool push(const std::string& text) {
        const auto number = double_of(text);
        const auto exact = Decimal::parse(text);
        if (!number || !exact) return false;
        const bool is_negative_zero = *number == 0 && text.starts_with('-');
        if (const auto i = exact->as_int64(); i && !is_negative_zero) {
            stack_.push_int64(*i);
        } else if (const auto u = exact->as_uint64(); u && !is_negative_zero) {
            stack_.push_uint64(*u);
        } else if (Decimal(*number) == *exact) {
            stack_.push_double(*number);
        } else {
            stack_.push_string(exact_number(exact->text()).get_string());
        }
        return true;
    }

    boost::json::value_stack stack_;
    std::string number_;
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct Slip {
    std::string_view begins;
    std::string_view words;
};
constexpr std::string_view kNoComments = "JSON has no comments; remove it";
constexpr std::array<Slip, 17> kSlips{{
    {"NaN", "NaN is no number of JSON"},
    {"Infinity", "Infinity is no number of JSON"},
    {"\xEF\xBB\xBF", "a byte order mark (U+FEFF) precedes the value; send the body without"},
    {"/", kNoComments},
    {"#", kNoComments},
    {"+", "a number of JSON has no '+'; remove it"},
    {".", "a number of JSON has a digit before its '.'; write 0."},
    {"'", "a JSON string is in double quotes"},
    {"True", "it is written true"},
    {"TRUE", "it is written true"},
    {"False", "it is written false"},
    {"FALSE", "it is written false"},
    {"None", "it is written null"},
    {"NULL", "it is written null"},
    {"=", "a ':' follows a name in JSON"},
    {";", "a ',' separates the members of JSON"},
    {",", "a value is missing before this ','"},
}};

/// The likely mistake at `at`, where the parser stopped; "" if none is recognized.
std::string slip_at(std::string_view text, std::size_t at) {
    const std::string_view rest = text.substr(at);
    if (rest.empty()) return "";
    for (const Slip& slip : kSlips)
        if (rest.starts_with(slip.begins)) return std::string(slip.words);
    const char before = at == 0 ? ' ' : text[at - 1];
    if (is_digit(rest[0]) && before == '0')
        return "a number of JSON has no leading zeros; write it without";
    if (static_cast<unsigned char>(rest[0]) < 0x20)
        return "a line end, a tab or another control character inside a text; write \\n, \\t or "
               "\\u00XX";
    const std::size_t last = text.substr(0, at).find_last_not_of(" \t\r\n");
    if ((rest[0] == '}' || rest[0] == ']') && last != text.npos && text[last] == ',')
        return "a ',' too many before this";
    return "";
}

/// The position of the first byte that is not part of a valid UTF-8 character.
std::size_t end_of_utf8(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = utf8_sequence(text.substr(at));
        if (length == 0) return at;
        at += length;
    }
    return text.size();
}

/// The fault at `used`, where the parser stopped.
JsonFault fault_at(std::string_view text, std::size_t used, const error_code& error) {
    if (text.find_first_not_of(" \t\r\n") == text.npos)
        return {0, "it is empty; send an object, such as {\"value\": 1}"};
    if (!is_utf8(text)) return {end_of_utf8(text), "this is not UTF-8"};
    // Inside a number or a word the parser stops at its end.
    std::string slip = slip_at(text, used);
    if (!slip.empty()) return {used, std::move(slip)};
    if (used >= text.size() || error == boost::json::error::incomplete)
        return {used, "it ends before it is complete; a bracket or a quote is not closed"};
    return {used, error == boost::json::error::syntax
                      ? "a value, a quote, a ':' or a ',' is missing here"
                      : error.message()};
}

}  // namespace

JsonRead read_json(std::string_view text) {
    boost::json::basic_parser<Builder> parser{boost::json::parse_options()};
    error_code error;
    const std::size_t used = parser.write_some(false, text.data(), text.size(), error);
    if (const auto& number = parser.handler().beyond) {
        const std::size_t begin = used - std::min(used, number->size());
        return {nullptr,
                JsonFault{begin, excerpt(*number) + " is beyond what a 64-bit number holds", true}};
    }
    if (error) return {nullptr, fault_at(text, used, error)};
    if (used < text.size()) {
        const bool comment = text[used] == '/' || text[used] == '#';
        return {nullptr, JsonFault{used, comment ? std::string(kNoComments)
                                                 : "something follows the value"}};
    }
    return {parser.handler().release(), std::nullopt};
}

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

/// The value as an integer if it is whole and fits; JSON does not distinguish integers.
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
