#pragma once

#include <boost/json/object.hpp>
#include <boost/system/result.hpp>
#include <cstdint>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// A refusal as RFC 9457 problem details.
struct Problem {
    Problem() = default;
    Problem(unsigned with_status, std::string with_detail)
        : status(with_status), detail(std::move(with_detail)) {}

    unsigned status = 500;
    std::string detail;              ///< one sentence for the user
    std::string kind;                ///< last part of the URN of its type; "": by status
    boost::json::object extensions;  ///< further members (RFC 9457 3.2)
    std::vector<std::pair<std::string, std::string>> headers;
};
template <class T>
using Parsed = boost::system::result<T, Problem>;

/// Ends a handler before anything is sent: its route answers the problem. Parsed::value() throws
/// Refused, too.
struct Refused : std::exception {
    explicit Refused(Problem with) : problem(std::move(with)) {}
    const char* what() const noexcept override { return problem.detail.c_str(); }

    Problem problem;
};
[[noreturn]] inline void throw_exception_from_error(const Problem& problem,
                                                    const boost::source_location&) {
    throw Refused(problem);
}

/// Makes a problem. `status`: 400-405, 409, 412, 413, 415, 421, 422, 428, 429, 431, 500 or
/// 502-504. `kind`: "": by status.
Problem problem(unsigned status, std::string detail, std::string_view kind = {});
/// Throws such a problem as Refused.
[[noreturn]] void refuse(unsigned status, std::string detail, std::string_view kind = {});
/// Makes a problem that is temporary: with Retry-After in seconds.
Problem passing_problem(unsigned status, std::string detail, std::int64_t seconds);
/// Returns 400 for an unknown name, suggesting the nearest of `known` or listing all. `what` is
/// "member", "query".
Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known);
/// Returns its members for a reply's body.
boost::json::object json_of(const Problem& problem);
HttpResponse to_response(const Problem& problem);

/// Returns 400 for an unknown or repeated query.
std::optional<Problem> check_queries(const HttpRequest& request,
                                     std::span<const std::string_view> known);
/// Returns the comma-separated parts of a query; none if absent.
std::vector<std::string> query_list(const HttpRequest& request, const std::string& name);
/// Returns a query value as an integer in [low, high]; `fallback` if absent.
Parsed<unsigned> query_number(const HttpRequest& request, const std::string& name, unsigned low,
                              unsigned high, unsigned fallback);

/// Returns a boolean query value; false if absent.
Parsed<bool> query_flag(const HttpRequest& request, const std::string& name);

}  // namespace panelgate::web
