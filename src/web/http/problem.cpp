#include "http/problem.hpp"

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>
#include <cstdlib>

#include "api/json_util.hpp"
#include "panelgate/modbus/exception.hpp"

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
        case 413:
            return "Content Too Large";
        case 415:
            return "Unsupported Media Type";
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

unsigned status_of(Fault fault) {
    switch (fault) {
        case Fault::denied:
            return 403;
        case Fault::malformed:
            return 400;
        case Fault::not_routed:
            return 404;
        case Fault::busy:
        case Fault::expired:
        case Fault::cancelled:
            return 503;
        case Fault::line_down:
        case Fault::line_lost:
        case Fault::damaged:
            return 502;
        case Fault::timeout:
        case Fault::offline:
            return 504;
    }
    std::abort();
}

const char* detail_of(Fault fault) {
    switch (fault) {
        case Fault::denied:
            return "no request may carry this function here";
        case Fault::malformed:
            return "the request contradicts its function code";
        case Fault::not_routed:
            return "no line has this station";
        case Fault::busy:
            return "the line's queue is full; try again";
        case Fault::expired:
            return "the line could not take the request before its deadline";
        case Fault::line_down:
            return "the line's device is not there";
        case Fault::line_lost:
            return "the line was lost while the request was on its way";
        case Fault::timeout:
            return "the station did not answer in time";
        case Fault::damaged:
            return "only damaged replies came back";
        case Fault::offline:
            return "the station is silent; it is probed from time to time";
        case Fault::cancelled:
            return "the gateway is stopping";
    }
    std::abort();
}

}  // namespace

Problem problem(unsigned status, std::string detail) { return {status, std::move(detail)}; }

Problem problem_of(Fault fault, bool transmitted) {
    Problem made = problem(status_of(fault), detail_of(fault));
    made.kind = label(fault);
    made.modbus_exception = static_cast<std::uint8_t>(modbus::to_exception(fault));
    made.transmitted = transmitted;
    if (made.status == 503) made.headers.emplace_back("Retry-After", "1");
    return made;
}

Problem problem_of_exception(std::uint8_t code, const std::string& meaning) {
    std::string detail = "the panel answered exception " + std::to_string(code) + ": ";
    detail += modbus::describe_exception(code);
    if (!meaning.empty()) detail += " (" + meaning + ")";
    Problem made = problem(code >= 1 && code <= 4 ? 422 : 502, std::move(detail));
    made.kind = "exception";
    made.modbus_exception = code;
    made.transmitted = true;
    return made;
}

HttpResponse to_response(const Problem& problem) {
    boost::json::object body;
    body["type"] = problem.kind.empty() ? "about:blank" : "urn:panelgate:problem:" + problem.kind;
    body["title"] = title_of(problem.status);
    body["status"] = problem.status;
    body["detail"] = problem.detail;
    if (problem.modbus_exception) body["modbus_exception"] = *problem.modbus_exception;
    if (problem.transmitted) body["transmitted"] = *problem.transmitted;
    HttpResponse response;
    response.status = problem.status;
    response.content_type = "application/problem+json";
    response.body = boost::json::serialize(body) + "\n";
    response.headers = problem.headers;
    return response;
}

}  // namespace panelgate::web
