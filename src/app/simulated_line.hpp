#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <memory>

#include "panelgate/config/config.hpp"
#include "panelgate/sim/simulated_bus.hpp"
#include "panelgate/web/api/directory.hpp"

namespace panelgate::app {

/// A simulated bus with the configured stations of a line.
std::shared_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 rt::Clock& clock, const config::Line& line);

/// How REST reaches the faults of a simulated panel; null for a real one (no bus).
std::shared_ptr<const web::SimulatedPanel> simulated_panel(
    const std::shared_ptr<sim::SimulatedBus>& bus, std::uint8_t station);

}  // namespace panelgate::app
