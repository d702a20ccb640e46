#pragma once

#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::profile {

/// Checks the profile across its keys and adds each error at the list item concerned. `functions`
/// and `areas` are the lists from which profile.functions and profile.areas were read.
void check_functions(const PanelProfile& profile, const yaml::Node& functions,
                     yaml::Problems& problems);
void check_areas(const PanelProfile& profile, const yaml::Node& areas, yaml::Problems& problems);
/// `serial` is the map from which profile.serial was read.
void check_serial(const Serial& settings, const yaml::Node& serial, yaml::Problems& problems);

}  // namespace panelgate::profile
