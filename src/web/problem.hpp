#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "http_types.hpp"
#include "panelgate/base/fault.hpp"

namespace panelgate::web {

/// Why a request is refused: RFC 9457.
struct Problem {
    Problem() = default;
    Problem(unsigned with_status, std::string with_detail)
        : status(with_status), detail(std::move(with_detail)) {}

    unsigned status = 500;
    std::string detail;  ///< one sentence for the user
    std::string kind;    ///< ends the type URN; "" = about:blank
    std::optional<std::uint8_t> modbus_exception;
    std::optional<bool> transmitted;
    std::vector<std::pair<std::string, std::string>> headers;
};
template <class T>
using Parsed = boost::system::result<T, Problem>;

Problem problem(unsigned status, std::string detail);
/// A bus that gave no reply (502 line down or damaged, 503 busy, 504 no reply in time).
Problem problem_of(Fault fault, bool transmitted);
/// A panel's exception reply: 422 for codes 1-4, 502 above. `meaning` is the manual's word, or "".
Problem problem_of_exception(std::uint8_t code, const std::string& meaning);

HttpResponse to_response(const Problem& problem);

}  // namespace panelgate::web
