#pragma once

#include <boost/json/object.hpp>
#include <span>
#include <string>
#include <string_view>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// Does whoever sent this Accept take text/csv rather than JSON? (RFC 9110 12.5.1; "" is no.)
bool prefers_csv(std::string_view accept);

/// One record (RFC 4180) of these fields.
std::string csv_line(std::span<const std::string_view> fields);
/// The same of an object's members: null and what it lacks are empty.
std::string csv_line(const boost::json::object& object, std::span<const std::string_view> columns);
HttpResponse csv_response(std::string body);

}  // namespace panelgate::web
