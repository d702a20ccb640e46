#pragma once

#include <cstdint>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// How a panel answers a request according to its manual, checked in the order of the Application
/// Protocol (chapter 7): function, quantity and structure, address.
enum class Judgement : std::uint8_t {
    fine,
    illegal_function,  ///< exception 01
    illegal_value,     ///< 03: structure or quantity
    illegal_address,   ///< 02: some items are outside the panel's memory
    write_protected,   ///< readable but not writable; the manuals disagree about the code
};

Judgement judge(const PanelProfile& profile, ByteView pdu);
Judgement judge(const PanelProfile& profile, const modbus::Request& request);
/// Returns why the request is not fine, as a clause for the user: "autonics-gplp-s has no function
/// 23".
std::string explain(const PanelProfile& profile, const modbus::Request& request);

/// Returns the area that contains the whole span, or nullptr.
const Area* find_readable(const PanelProfile& profile, const modbus::Span& span);

}  // namespace panelgate::profile
