#pragma once

#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::profile {

/// Reads a profile's `simulation` map; its areas are known already.
void load_simulation(const yaml::Node& node, PanelProfile& profile, yaml::Problems& problems);

}  // namespace panelgate::profile
