#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// An item of a panel's memory.
struct Item {
    const Area* area = nullptr;  ///< of the profile in which it was found
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

/// Parses a notation: "UB180" -> area UB, address 288. Case-insensitive; UB00180 = UB180. The error
/// for unknown text lists the panel's notations; for a number out of range it gives the range.
boost::system::result<Item, NotationError> parse_notation(const PanelProfile& profile,
                                                          std::string_view text);

/// Returns the canonical notation of an item of this area: 288 -> "UB180". The address must be
/// readable.
std::string format_notation(const Area& area, std::uint16_t address);
/// The same for the first area that contains the item; "" if none does.
std::string format_notation(const PanelProfile& profile, modbus::Table table,
                            std::uint16_t address);

}  // namespace panelgate::profile
