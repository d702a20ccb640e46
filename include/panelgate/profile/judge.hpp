#pragma once

#include <cstdint>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// What a panel's manual says to a request, before anything is executed, in the order of the
/// Application Protocol (chapter 7): function, quantity and structure, address.
enum class Judgement : std::uint8_t {
    fine,
    illegal_function,  ///< exception 01
    illegal_value,     ///< 03: structure or quantity
    illegal_address,   ///< 02: not all of it is memory of the panel
    write_protected,   ///< it can be read and not written; the manuals disagree about the code
};

Judgement judge(const PanelProfile& profile, ByteView pdu);
Judgement judge(const PanelProfile& profile, const modbus::Request& request);
/// Why it is not fine, as a clause for the user: "autonics-gplp-s has no function 23".
std::string explain(const PanelProfile& profile, const modbus::Request& request);

/// The one area that holds the whole span, or nullptr.
const Area* find_readable(const PanelProfile& profile, const modbus::Span& span);

}  // namespace panelgate::profile
