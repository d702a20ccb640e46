#pragma once

#include <boost/json/object.hpp>
#include <boost/system/result.hpp>
#include <string>
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
HttpResponse to_response(const Problem& problem);

}  // namespace panelgate::web
