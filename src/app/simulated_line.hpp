#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/config/config.hpp"
#include "panelgate/sim/simulated_bus.hpp"

namespace panelgate::app {

/// A simulated bus with the configured stations of a line.
std::unique_ptr<sim::SimulatedBus> simulate_line(boost::asio::any_io_executor executor,
                                                 rt::Clock& clock, const config::Line& line);

}  // namespace panelgate::app
