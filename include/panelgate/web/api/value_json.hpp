#pragma once

#include <boost/json/value.hpp>
#include <string_view>

#include "panelgate/points/value.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// A point's value in JSON, with every digit; for json_text().
boost::json::value json_of(const points::Value& value);

/// Parses any JSON text. 400 with line and column of the error; a duplicate member is an error,
/// too, at any depth.
Parsed<boost::json::value> parse_json(std::string_view text);
/// The new value of a point, as the client has sent it.
Parsed<points::Value> value_of(const boost::json::value& value);

}  // namespace panelgate::web
