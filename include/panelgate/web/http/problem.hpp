#pragma once

#include <boost/json/object.hpp>
#include <boost/system/result.hpp>
#include <cstdint>
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
    std::string detail;  ///< one sentence for the user
    std::string kind;    ///< last part of the type URN: one of problem_kinds(); "": by status
    boost::json::object extensions;  ///< further members (RFC 9457 3.2)
    std::vector<std::pair<std::string, std::string>> headers;
};
template <class T>
using Parsed = boost::system::result<T, Problem>;

/// A kind of problem with its URN: "urn:panelgate:problem:" and the word.
struct ProblemKind {
    std::string_view word;
    std::string_view meaning;  ///< one sentence for the documentation
    unsigned of_status = 0;    ///< not 0: default kind for this status
};
std::span<const ProblemKind> problem_kinds();

/// Makes a problem. `kind`: a word of problem_kinds().
Problem problem(unsigned status, std::string detail, std::string_view kind = {});
/// ... that is temporary: with Retry-After in seconds.
Problem passing_problem(unsigned status, std::string detail, std::int64_t seconds);
/// Returns 400 for an unknown name, suggesting the nearest of `known` or listing all. `what` is
/// "member", "query".
Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known);
/// Returns its members for a reply's body.
boost::json::object json_of(const Problem& problem);
HttpResponse to_response(const Problem& problem);

}  // namespace panelgate::web
