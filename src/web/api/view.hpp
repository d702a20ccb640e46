#pragma once

#include <boost/json/array.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// How a client wants values told, in its own words: queries, or members of an entry of a list.
struct Wording {
    std::optional<std::string> type;   ///< as points have it
    std::optional<std::string> order;  ///< ABCD…
    std::optional<unsigned> length;    ///< characters of a string
    unsigned count = 1;                ///< values
    bool raw = false;
};
inline constexpr unsigned kMaxText = 240;  ///< characters of a string

/// From the queries type, order, length and raw.
Parsed<Wording> wording_of(const HttpRequest& request);
/// From the members of these names, and count.
Parsed<Wording> wording_of(const boost::json::object& entry);

/// How the items of a read are understood. Made of a wording and a table, so that both agree.
struct View {
    points::Point value;  ///< what each value is: its type, order and length
    unsigned items = 1;   ///< of the table, of all values
    bool raw = false;     ///< the items themselves are shown, too
};
/// 400 for a type or an order that nobody knows, or that a table of bits does not have.
Parsed<View> view_of(const Wording& wording, modbus::Table table);

/// The values in these items (bits as 0 and 1), as many as view.items: null where there is none.
boost::json::array values_of(const View& view, std::span<const std::uint16_t> items);

}  // namespace panelgate::web
