#pragma once

#include <boost/json/value.hpp>
#include <string>

namespace panelgate::web {

/// JSON for people and programs, in one line: numbers by number_text(), what is not finite is null.
/// The one way from a value to a body, an event or a message.
std::string json_text(const boost::json::value& value);
/// A text (UTF-8) for a message: cut where it is long.
std::string excerpt(std::string text);

}  // namespace panelgate::web
