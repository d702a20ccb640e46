#pragma once

#include <boost/system/result.hpp>
#include <string>
#include <string_view>

#include "panelgate/profile/notation.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// Returns a profile as a readable table, for `panelgate profiles NAME`.
std::string describe(const PanelProfile& profile);

/// For `panelgate address PROFILE WHAT`. WHAT is a notation ("UB180") or table and address
/// ("coil/288", "holding-registers/0x64", "coil 288"). The first line of the result is `UB180 ->
/// coil 288 0x0120` or `coil 288 0x0120 -> UB180`; the others name the item in other notations and
/// the functions.
boost::system::result<std::string, NotationError> describe_address(const PanelProfile& profile,
                                                                   std::string_view what);

}  // namespace panelgate::profile
