#pragma once

#include <span>
#include <string>
#include <string_view>

#include "panelgate/base/text.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Returns 400 for an unknown or repeated query.
std::optional<Problem> check_queries(const HttpRequest& request,
                                     std::span<const std::string_view> known);

/// Returns a query value as an integer in [low, high]; `fallback` if absent.
Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback);

/// Returns a boolean query value; false if absent.
Parsed<bool> query_flag(const HttpRequest& request, const std::string& name);

}  // namespace panelgate::web
