#pragma once

#include <boost/json/value.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::web {

/// Serializes to one line of JSON: numbers by number_text(), non-finite ones as null. The only way
/// from a value to a body, event or message.
std::string json_text(const boost::json::value& value);
/// Returns a number with more digits than a double, for json_text() only: boost::json sees a string
/// that no JSON can contain.
boost::json::value exact_number(std::string_view digits);
/// Returns its digits; nullopt for any other value.
std::optional<std::string_view> exact_digits(const boost::json::value& value);
/// Returns a text (UTF-8) for a message, truncated if long.
std::string excerpt(std::string text);

}  // namespace panelgate::web
