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
#include "panelgate/points/point.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

struct RepeatedMember {
    std::string name;
    std::size_t at = 0;  ///< where the second occurrence begins in the text
};

/// Finds the first duplicate member of any object in this text, at any depth; value parsers
/// silently keep the last one. In invalid JSON only the part before the fault is searched.
std::optional<RepeatedMember> find_repeated_member(std::string_view json);

/// The member names that a body may have; case-sensitive.
using Members = std::initializer_list<std::string_view>;

/// Parses the body as an object. 400 with line and column of the error; a duplicate member is an
/// error, too, at any depth.
Parsed<boost::json::object> parse_object(std::string_view body);
/// The same; 400 for the first member that is not in `known`.
Parsed<boost::json::object> parse_object(std::string_view body, Members known);

/// A whole number in [low, high]; 10.0 is whole. `name` is used in the text of the 400.
Parsed<std::int64_t> whole_number(const boost::json::value& value, std::string_view name,
                                  std::int64_t low, std::int64_t high);
/// The same for a required member.
Parsed<std::int64_t> number_member(const boost::json::object& object, std::string_view name,
                                   std::int64_t low, std::int64_t high);
Parsed<std::string> string_member(const boost::json::object& object, std::string_view name);

/// The member "values", or the one "value" in its place: at least one.
Parsed<boost::json::array> values_member(const boost::json::object& object);
/// The member "values" as cells of a table: bits are true, false, 0 or 1; registers are 0..65535,
/// or -32768..-1 for their two's complement. At least one.
Parsed<std::vector<std::uint16_t>> values_member(const boost::json::object& object,
                                                 modbus::Table table);
/// The member "value": the new value of a point.
Parsed<points::Value> value_member(const boost::json::object& object);
/// True or false; false where there is no such member.
Parsed<bool> flag_member(const boost::json::object& object, std::string_view name);

}  // namespace panelgate::web
