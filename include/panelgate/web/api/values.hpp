#pragma once

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

// JSON to values and back: the only place for types, orders and members of a body.

/// The member names that a body may have; case-sensitive.
using Members = std::initializer_list<std::string_view>;

/// Parses the body as an object; 400 for any other text, as parse_json().
Parsed<boost::json::object> parse_object(std::string_view body);
/// The same; 400 for the first member that is not in `known`.
Parsed<boost::json::object> parse_object(std::string_view body, Members known);

/// A required member that is a whole number in [low, high]; 10.0 is whole.
Parsed<std::int64_t> number_member(const boost::json::object& object, std::string_view name,
                                   std::int64_t low, std::int64_t high);
Parsed<std::string> string_member(const boost::json::object& object, std::string_view name);
/// True or false; false without such a member.
Parsed<bool> flag_member(const boost::json::object& object, std::string_view name);

/// A point's value in JSON, with every digit; for json_text().
boost::json::value json_of(const points::Value& value);
/// The new value of a point, as the client has sent it.
Parsed<points::Value> value_of(const boost::json::value& value);
/// The same of the member "value".
Parsed<points::Value> value_member(const boost::json::object& object);

/// How a client wants values rendered, as given: from queries, or from the members of an object.
struct ValueFormat {
    std::optional<std::string> type;   ///< a point's type
    std::optional<std::string> order;  ///< ABCD...
    std::optional<unsigned> length;    ///< characters of a string
    unsigned count = 1;                ///< values
    bool raw = false;
};
/// Reads the queries type, order, length and raw.
Parsed<ValueFormat> format_of(const HttpRequest& request);
/// Reads the members of these names, and count.
Parsed<ValueFormat> format_of(const boost::json::object& object);

/// How the items of a table are interpreted.
struct View {
    points::Point value;  ///< type, order and length of each value
    unsigned items = 1;   ///< items of all values together
    bool raw = false;     ///< show the raw items, too
};
/// 400 for a type or an order that is unknown or not possible for a table of bits.
Parsed<View> view_of(const ValueFormat& format, modbus::Table table);

/// The values in these items (bits as 0 and 1); null for an item range that has no value.
boost::json::array values_of(const View& view, std::span<const std::uint16_t> items);
/// The cells that a body writes by its "values", or the one "value" in their place: at least one.
/// Without "type", "order" and "length" bits are true, false, 0 or 1, and registers are 0..65535,
/// or -32768..-1 for their two's complement. A string takes "length" characters, or as many as the
/// text needs.
Parsed<std::vector<std::uint16_t>> cells_of(const boost::json::object& body, modbus::Table table);

/// The refusal of a value as a problem. `more` is a hint added where the value has too many digits.
Problem problem_of(const points::WriteRefusal& refusal, const char* more);

}  // namespace panelgate::web
