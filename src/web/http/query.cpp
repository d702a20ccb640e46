#include "panelgate/web/http/query.hpp"

#include <algorithm>
#include <string>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

std::optional<Problem> check_queries(const HttpRequest& request,
                                     std::span<const std::string_view> known) {
    for (const auto& [name, value] : request.query) {
        if (std::ranges::find(known, name) == known.end())
            return unknown_name("query", name, known);
        if (request.query.count(name) > 1)
            return problem(400, "the query '" + name + "' is given twice");
    }
    return std::nullopt;
}

Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback) {
    const auto given = request.query.find(name);
    if (given == request.query.end()) return fallback;
    const auto number = to_number(given->second);
    if (number && *number >= low && *number <= high) return *number;
    return problem(400, name + " must be a whole number from " + std::to_string(low) + " to " +
                            std::to_string(high));
}

Parsed<bool> query_flag(const HttpRequest& request, const std::string& name) {
    const auto given = request.query.find(name);
    if (given == request.query.end() || given->second == "false") return false;
    if (given->second == "true") return true;
    return problem(400, name + " is true or false, not '" + excerpt(given->second) + '\'');
}

}  // namespace panelgate::web
