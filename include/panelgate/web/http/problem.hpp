#pragma once

#include <boost/json/object.hpp>
#include <boost/system/result.hpp>
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
    std::string kind;                ///< ends the type URN; "" = about:blank
    boost::json::object extensions;  ///< further members (RFC 9457 3.2)
    std::vector<std::pair<std::string, std::string>> headers;
};
template <class T>
using Parsed = boost::system::result<T, Problem>;

Problem problem(unsigned status, std::string detail);
/// 400 for what nobody knows here; names the nearest of what is known, or all of it. `what` is
/// "member", "query".
Problem unknown_name(const std::string& what, const std::string& name,
                     std::span<const std::string_view> known);
/// Its members, as the body of an answer has them.
boost::json::object json_of(const Problem& problem);
HttpResponse to_response(const Problem& problem);

}  // namespace panelgate::web
