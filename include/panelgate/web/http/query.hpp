#pragma once

#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Parses the whole text as an unsigned number of this base; nullopt on failure.
template <class Number = unsigned>
std::optional<Number> to_number(std::string_view text, int base = 10) {
    Number number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// Returns 400 for an unknown or repeated query.
std::optional<Problem> check_queries(const HttpRequest& request,
                                     std::span<const std::string_view> known);

/// Returns a query value as an integer in [low, high]; `fallback` if absent.
Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback);

/// Returns a boolean query value; false if absent.
Parsed<bool> query_flag(const HttpRequest& request, const std::string& name);

}  // namespace panelgate::web
