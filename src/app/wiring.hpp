#pragma once

#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/points/settings.hpp"
#include "plant.hpp"

namespace panelgate::app {

// What the configuration means to each module.

bus::Settings bus_settings(const config::Line& line);
/// The stations that have points or poll blocks.
std::vector<points::PolledStation> polled_stations(const config::Line& line);
/// Which items are shown elsewhere as well.
points::SharedMemory memory_of(const profile::ProfileRef& panel);
/// The panel has function 15 or 16 for this table.
bool takes_multiple(const profile::PanelProfile& panel, modbus::Table table);
/// A relay whose ends the plant has: the configuration was checked.
points::RelayRoute route_of(const Plant& plant, const points::Relay& relay);

}  // namespace panelgate::app
