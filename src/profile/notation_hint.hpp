#pragma once

#include <string>
#include <string_view>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// What a person meant by a notation that the panel does not have, as the end of a message: ";
/// write 400101". Of numbers alone, of reference numbers (40101, 4x101), of other makers' words for
/// a register (%MW100, HR100, 0x64), of blanks inside and of ranges. Empty when nobody knows.
std::string notation_hint(const PanelProfile& profile, std::string_view typed);

}  // namespace panelgate::profile
