#include "panelgate/web/http/problem.hpp"

#include "panelgate/base/suggest.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

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

}  // namespace

Problem problem(unsigned status, std::string detail) { return {status, std::move(detail)}; }

Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known) {
    std::string text = "unknown " + what + " '" + excerpt(name) + '\'';
    const std::string near = nearest(excerpt(name), known);
    if (!near.empty()) return problem(400, text + "; did you mean '" + near + "'?");
    text += known.empty() ? "; there is none here" : "; known here: ";
    for (const std::string_view& word : known) {
        if (&word != &known.front()) text += ", ";
        text += word;
    }
    return problem(400, std::move(text));
}

boost::json::object json_of(const Problem& problem) {
    boost::json::object body;
    body["type"] = problem.kind.empty() ? "about:blank" : "urn:panelgate:problem:" + problem.kind;
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
