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

/// The whole text as a number of this base, without sign, or nothing. Number: unsigned.
template <class Number = unsigned>
std::optional<Number> to_number(std::string_view text, int base = 10) {
    Number number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// 400 for a query that is not one of these, or that is given twice: what was meant nobody knows.
std::optional<Problem> check_queries(const HttpRequest& request,
                                     std::span<const std::string_view> known);

/// A query value as a whole number in [low, high]; `fallback` when it is not given.
Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback);

/// A query that is true or false; false when it is not given.
Parsed<bool> query_flag(const HttpRequest& request, const std::string& name);

}  // namespace panelgate::web
