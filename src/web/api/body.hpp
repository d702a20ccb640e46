#pragma once

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/points/value.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

struct RepeatedMember {
    std::string name;
    std::size_t at = 0;  ///< where the second one begins, in the text
};

/// The first member that an object in this text has twice, at any depth: parsers of values keep the
/// last one and say nothing. Of a text that is no JSON: what is found before its fault.
std::optional<RepeatedMember> find_repeated_member(std::string_view json);

/// The names of members that a body may have; they are told apart by case, too.
using Members = std::initializer_list<std::string_view>;

/// The body as an object; 400 with line and column of what is wrong, a member that comes twice
/// included, at any depth.
Parsed<boost::json::object> parse_object(std::string_view body);
/// The same of one that has no other members: 400 for the first that nobody knows.
Parsed<boost::json::object> parse_object(std::string_view body, Members known);

/// A whole number in [low, high]; `name` is for the 400's text. 10.0 is whole.
Parsed<std::int64_t> whole_number(const boost::json::value& value, std::string_view name,
                                  std::int64_t low, std::int64_t high);
/// The same of a required member.
Parsed<std::int64_t> number_member(const boost::json::object& object, std::string_view name,
                                   std::int64_t low, std::int64_t high);
Parsed<std::string> string_member(const boost::json::object& object, std::string_view name);

/// The member "values", or the one "value" in its place: at least one.
Parsed<boost::json::array> values_member(const boost::json::object& object);
/// The member "values" as cells of a table: bits are true, false, 0 or 1; registers are 0..65535,
/// or -32768..-1 for their two's complement. At least one.
Parsed<std::vector<std::uint16_t>> values_member(const boost::json::object& object,
                                                 modbus::Table table);
/// The member "value": a point's new one.
Parsed<points::Value> value_member(const boost::json::object& object);
/// True or false; false where there is no such member.
Parsed<bool> flag_member(const boost::json::object& object, std::string_view name);

}  // namespace panelgate::web
