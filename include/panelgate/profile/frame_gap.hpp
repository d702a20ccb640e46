#pragma once

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// Silence between frames that the panel's manual asks for at this rate; 0 in ASCII, for manuals
/// speak of RTU.
Duration asked_gap(const SerialFormat& serial, const PanelProfile& profile);
/// That or the standard's (silent_interval()), whichever is longer: what `frame_gap: auto` means.
Duration automatic_gap(const SerialFormat& serial, const PanelProfile& profile);

}  // namespace panelgate::profile
