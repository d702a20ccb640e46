#pragma once

#include <boost/json/object.hpp>
#include <cstddef>
#include <functional>
#include <span>
#include <string_view>

#include "panelgate/web/http/site.hpp"

namespace panelgate::web {

/// A list whose entries are flat objects. What `entry` looks at outlives the request, or `entry`
/// holds it.
struct Table {
    boost::json::object members;                ///< of JSON, in front of the list
    std::string_view name;                      ///< of the list
    std::span<const std::string_view> columns;  ///< of text/csv
    std::size_t count = 0;
    std::function<boost::json::object(std::size_t)> entry;  ///< 0 to count - 1
};

/// As JSON, or as text/csv to who prefers that; made in pieces, between which others have their
/// turn.
Handling table_answer(HttpRequest request, Table table);

}  // namespace panelgate::web
