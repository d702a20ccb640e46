#pragma once

#include <vector>

#include "loader.hpp"
#include "panelgate/access/settings.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// Reads `range`: what it names at each station that the rule is about.
void load_range(Loading& loading, yaml::MapReader& in, access::Rule& rule);

/// Returns these items as all tables show them, where nothing else is shown with them: a word of
/// which only a bit is among them is not. For rules that allow.
std::vector<modbus::Span> shown_wholly(const profile::PanelProfile& profile,
                                       const modbus::Span& items);
/// Returns all that shows one of these items, also with others: the word of a bit, but not the
/// word's other bits. For rules that deny.
std::vector<modbus::Span> shown_in_part(const profile::PanelProfile& profile,
                                        const modbus::Span& items);

}  // namespace panelgate::config
