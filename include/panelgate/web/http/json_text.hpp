#pragma once

#include <boost/json/value.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::web {

/// JSON for people and programs, in one line: numbers by number_text(), what is not finite is null.
/// The one way from a value to a body, an event or a message.
std::string json_text(const boost::json::value& value);
/// A number with more digits than a double has, for json_text() alone: to boost::json it is a text
/// that no JSON can hold.
boost::json::value exact_number(std::string_view digits);
/// Its digits; nothing for any other value.
std::optional<std::string_view> exact_digits(const boost::json::value& value);
/// A text (UTF-8) for a message: cut where it is long.
std::string excerpt(std::string text);

}  // namespace panelgate::web
