#pragma once

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Serializes to one line of JSON: numbers by number_text(), non-finite ones as null. The only way
/// from a value to a body, event or message.
std::string json_text(const boost::json::value& value);
/// Parses any JSON text and keeps numbers exact: whole numbers become 64-bit integers where they
/// fit, 9e18 and 9007199254740993.0 included; other numbers become doubles, or exact_number() where
/// a double has too few digits. 400 with line and column for a text that is not JSON, for a member
/// that an object has twice, and for a number beyond the range of a double or below its precision.
Parsed<boost::json::value> parse_json(std::string_view text);
/// Returns a number with more digits than a double, for json_text() only: boost::json sees a string
/// that no JSON can contain.
boost::json::value exact_number(std::string_view digits);
/// Returns the digits of an exact_number(); nullopt for any other value.
std::optional<std::string_view> exact_digits(const boost::json::value& value);
/// Returns the text of a member; "" without such a member, or if it is no text.
std::string member_text(const boost::json::object& object, std::string_view name);
/// Returns a text (UTF-8) for a message, truncated if long.
std::string excerpt(std::string text);

}  // namespace panelgate::web
