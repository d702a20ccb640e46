#include "panelgate/web/http/problem.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "panelgate/base/text.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

struct Status {
    unsigned number;
    std::string_view title;  ///< RFC 9110 15
    std::string_view kind;   ///< of a problem that names no other
};
constexpr Status kStatuses[] = {
    {400, "Bad Request", "malformed"},
    {401, "Unauthorized", "unauthorized"},
    {403, "Forbidden", "forbidden"},
    {404, "Not Found", "not-found"},
    {405, "Method Not Allowed", "method-not-allowed"},
    {409, "Conflict", "conflict"},
    {412, "Precondition Failed", "precondition-failed"},
    {413, "Content Too Large", "content-too-large"},
    {415, "Unsupported Media Type", "unsupported-media-type"},
    {421, "Misdirected Request", "misdirected"},
    {422, "Unprocessable Content", "unprocessable"},
    {428, "Precondition Required", "precondition-required"},
    {429, "Too Many Requests", "too-many-requests"},
    {431, "Request Header Fields Too Large", "header-too-large"},
    {500, "Internal Server Error", "internal"},
    {502, "Bad Gateway", "bad-gateway"},
    {503, "Service Unavailable", "unavailable"},
    {504, "Gateway Timeout", "gateway-timeout"},
};

}  // namespace

Problem problem(unsigned status, std::string detail, std::string_view kind) {
    Problem made{status, std::move(detail)};
    made.kind = kind;
    return made;
}

void refuse(unsigned status, std::string detail, std::string_view kind) {
    throw Refused(problem(status, std::move(detail), kind));
}

Problem passing_problem(unsigned status, std::string detail, std::int64_t seconds) {
    Problem made = problem(status, std::move(detail));
    made.headers.emplace_back("Retry-After", std::to_string(seconds));
    return made;
}

Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known) {
    std::string text = "unknown " + what + " '" + excerpt(name) + '\'';
    const std::string near = nearest(excerpt(name), known);
    if (!near.empty())
        return problem(400, text + "; did you mean '" + near + "'?", "unknown-member");
    text += known.empty() ? "; there is none here" : "; known here: ";
    for (const std::string_view& word : known) {
        if (&word != &known.front()) text += ", ";
        text += word;
    }
    return problem(400, std::move(text), "unknown-member");
}

boost::json::object json_of(const Problem& problem) {
    const auto known = std::ranges::find(kStatuses, problem.status, &Status::number);
    const Status status =
        known == std::end(kStatuses) ? Status{problem.status, "Error", "internal"} : *known;
    boost::json::object body;
    body["type"] =
        "urn:panelgate:problem:" + (problem.kind.empty() ? std::string(status.kind) : problem.kind);
    body["title"] = status.title;
    body["status"] = problem.status;
    body["detail"] = problem.detail;
    for (const auto& [name, value] : problem.extensions) body[name] = value;
    return body;
}

HttpResponse to_response(const Problem& problem) {
    HttpResponse response;
    response.status = problem.status;
    response.content_type = "application/problem+json";
    response.body = json_text(json_of(problem)) + "\n";
    response.headers = problem.headers;
    return response;
}

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

std::vector<std::string> query_list(const HttpRequest& request, const std::string& name) {
    std::vector<std::string> parts;
    const auto given = request.query.find(name);
    if (given == request.query.end()) return parts;
    std::istringstream in(given->second);
    for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
    return parts;
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
