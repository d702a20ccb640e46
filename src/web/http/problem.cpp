#include "panelgate/web/http/problem.hpp"

#include <algorithm>
#include <iterator>

#include "panelgate/base/text.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

constexpr ProblemKind kKinds[] = {
    {"malformed", "The request cannot be understood, or a member or query has no such value.", 400},
    {"unknown-member", "An unknown member or query parameter.", 0},
    {"unauthorized", "There is no token, or none that the gateway knows.", 401},
    {"forbidden", "The token's role may not do this.", 403},
    {"foreign-page", "A page of another site asks.", 0},
    {"not-found", "There is nothing at this path.", 404},
    {"unknown-line", "No line has this name.", 0},
    {"unknown-station", "No station has this name.", 0},
    {"unknown-point", "The station has no point of this name.", 0},
    {"unknown-table", "There is no such table.", 0},
    {"unknown-notation", "The panel's profile has no such place.", 0},
    {"method-not-allowed", "The path does not understand this method.", 405},
    {"not-writable", "The table cannot be written.", 0},
    {"conflict", "Something else is under way.", 409},
    {"content-too-large", "The body is longer than the gateway takes.", 413},
    {"unsupported-media-type", "The body has another form than JSON.", 415},
    {"misdirected", "The gateway does not have this name.", 421},
    {"unprocessable", "The request is understood, and cannot be done as it is.", 422},
    {"outside-limits", "The value is outside the limits of its point.", 0},
    {"too-many", "More items than one request may have.", 0},
    {"too-many-requests",
     "Too many wrong tokens came from this address; Retry-After tells when the minute is over.",
     429},
    {"header-too-large", "The header is longer than the gateway takes.", 431},
    {"internal", "The gateway failed.", 500},
    {"bad-gateway", "What came from the panel is no answer.", 502},
    {"unavailable", "The gateway is busy; Retry-After says when to come again.", 503},
    {"gateway-timeout", "No answer came in time.", 504},
    {"refused", "A guard, an access or the line's mode rules it out; `rule` says which.", 0},
    {"exception", "The panel answered an exception; `modbus_exception` is its code.", 0},
    {"line_down", "The line's device is not there.", 0},
    {"timeout", "The panel did not answer in time.", 0},
    {"damaged", "Only damaged replies came.", 0},
    {"wrong", "Only good frames came that do not answer the request.", 0},
    {"offline", "The panel is silent and was not asked.", 0},
    {"busy", "The line's queue is full.", 0},
    {"expired", "The line could not take the request before its deadline.", 0},
    {"cancelled", "The client had disconnected, or the gateway is stopping.", 0},
    {"denied", "It is not allowed.", 0},
    {"not_routed", "No line has this station.", 0},
    {"line_lost", "The line was lost while the request was under way.", 0},
    {"invalid-configuration", "The configuration has faults; `faults` lists them.", 0},
    {"reload-failed", "The configuration could not be served.", 0},
    {"reload-weaker", "The way back would protect less than what runs.", 0},
};

std::string title_of(unsigned status) {
    switch (status) {
        case 400:
            return "Bad Request";
        case 401:
            return "Unauthorized";
        case 403:
            return "Forbidden";
        case 404:
            return "Not Found";
        case 405:
            return "Method Not Allowed";
        case 409:
            return "Conflict";
        case 413:
            return "Content Too Large";
        case 415:
            return "Unsupported Media Type";
        case 421:
            return "Misdirected Request";
        case 422:
            return "Unprocessable Content";
        case 429:
            return "Too Many Requests";
        case 431:
            return "Request Header Fields Too Large";
        case 500:
            return "Internal Server Error";
        case 502:
            return "Bad Gateway";
        case 503:
            return "Service Unavailable";
        case 504:
            return "Gateway Timeout";
    }
    return "Error";
}

std::string kind_of(const Problem& problem) {
    if (!problem.kind.empty()) return problem.kind;
    const auto known = std::ranges::find(kKinds, problem.status, &ProblemKind::of_status);
    return std::string(known == std::end(kKinds) ? kKinds[0].word : known->word);
}

}  // namespace

std::span<const ProblemKind> problem_kinds() { return kKinds; }

Problem problem(unsigned status, std::string detail, std::string_view kind) {
    Problem made{status, std::move(detail)};
    made.kind = kind;
    return made;
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
    boost::json::object body;
    body["type"] = "urn:panelgate:problem:" + kind_of(problem);
    body["title"] = title_of(problem.status);
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

}  // namespace panelgate::web
