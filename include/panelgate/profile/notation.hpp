#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// An item of a panel's memory.
struct Item {
    const Area* area = nullptr;  ///< of the profile it was found with
    std::uint16_t address = 0;   ///< 0-based, in area->table
};

/// Why a text is not an item of a panel: one sentence for the user.
struct NotationError {
    enum class Kind : std::uint8_t { unknown, malformed, out_of_range };
    Kind kind = Kind::unknown;
    std::string message;
};
[[noreturn]] void throw_exception_from_error(const NotationError& error,
                                             const boost::source_location& where);

/// "UB180" -> area UB, address 288. Letters in any case; UB00180 = UB180. A text no area
/// understands says which notations the panel has; a number outside says what the range is.
boost::system::result<Item, NotationError> parse_notation(const PanelProfile& profile,
                                                          std::string_view text);

/// The canonical notation of an item of this area: 288 -> "UB180". The address must be readable.
std::string format_notation(const Area& area, std::uint16_t address);
/// In the first area that reaches the item; "" when none does.
std::string format_notation(const PanelProfile& profile, modbus::Table table,
                            std::uint16_t address);

}  // namespace panelgate::profile
