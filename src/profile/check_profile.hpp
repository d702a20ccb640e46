#pragma once

#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::profile {

/// What one key alone cannot show: faults between the parts of a profile that was read whole, each
/// with the place of the list item it is about. `functions` and `areas` are the lists that
/// profile.functions and profile.areas were read from, item by item.
void check_functions(const PanelProfile& profile, const yaml::Node& functions,
                     yaml::Problems& problems);
void check_areas(const PanelProfile& profile, const yaml::Node& areas, yaml::Problems& problems);
/// `serial` is the map that profile.serial was read from.
void check_serial(const Serial& settings, const yaml::Node& serial, yaml::Problems& problems);

}  // namespace panelgate::profile
