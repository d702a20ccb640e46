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

/// Why a request is refused: RFC 9457.
struct Problem {
    Problem() = default;
    Problem(unsigned with_status, std::string with_detail)
        : status(with_status), detail(std::move(with_detail)) {}

    unsigned status = 500;
    std::string detail;              ///< one sentence for the user
    std::string kind;                ///< ends the type URN: one of problem_kinds(); "": by status
    boost::json::object extensions;  ///< further members (RFC 9457 3.2)
    std::vector<std::pair<std::string, std::string>> headers;
};
template <class T>
using Parsed = boost::system::result<T, Problem>;

/// What can go wrong, each with a URN of its own: "urn:panelgate:problem:" and its word.
struct ProblemKind {
    std::string_view word;
    std::string_view meaning;  ///< one sentence for who reads the documentation
    unsigned of_status = 0;    ///< not 0: the kind of all of this status that have no better one
};
std::span<const ProblemKind> problem_kinds();

/// `kind`: a word of problem_kinds().
Problem problem(unsigned status, std::string detail, std::string_view kind = {});
/// ... that is over in so many seconds: with Retry-After.
Problem passing_problem(unsigned status, std::string detail, std::int64_t seconds);
/// 400 for what nobody knows here; names the nearest of what is known, or all of it. `what` is
/// "member", "query".
Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known);
/// Its members, as the body of an answer has them.
boost::json::object json_of(const Problem& problem);
HttpResponse to_response(const Problem& problem);

}  // namespace panelgate::web
