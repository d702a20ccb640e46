#pragma once

#include <vector>

#include "panelgate/modbus/span.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// Everything that a write of these items changes, as the panel's tables show it: the items, the
/// same memory by other tables (`also`), words by their bits and bits by their words (`view_of`).
std::vector<modbus::Span> shown_as(const PanelProfile& profile, const modbus::Span& written);

}  // namespace panelgate::profile
