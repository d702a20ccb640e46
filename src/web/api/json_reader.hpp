#pragma once

#include <boost/json/value.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::web {

/// Why a text is no value, and where.
struct JsonFault {
    std::size_t at = 0;  ///< in the text
    std::string what;
    bool is_json = false;  ///< but holds a number that none here could be
};

struct JsonRead {
    boost::json::value value;
    std::optional<JsonFault> fault;
};

/// Numbers as they are written: whole ones are integers of 64 bits as far as they fit, 9e18 and
/// 9007199254740993.0 included; others doubles, or exact_number() where
/// a double has not as many digits. One beyond every double, and one that
/// would become 0, is a fault.
JsonRead read_json(std::string_view text);

}  // namespace panelgate::web
