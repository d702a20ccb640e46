#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/sim/misbehaviour.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::sim {

/// Panels on one RS-485 line behind a pseudo-terminal, paced at the line's baud: a request ends
/// after its wire time and t3.5 of silence, reply bytes arrive when a real line would deliver them.
/// Some panels ignore a request with a gap (GT: 24 bit times). Each panel thinks on its own and
/// hears nothing meanwhile; panels that send at the same time damage both replies, as on a real
/// line.
class SimulatedBus {
  public:
    /// Throws std::system_error when there is no pty left. The clock and the stations' profiles
    /// must outlive it.
    SimulatedBus(boost::asio::any_io_executor executor, rt::Clock& clock, Settings settings,
                 std::vector<Station> stations);
    ~SimulatedBus();

    /// Returns the path of the pty, which a gateway opens.
    const std::string& device() const;
    void start();
    void stop();

    bool has(std::uint8_t station) const;
    /// Takes effect from the next request on.
    void set_faults(std::uint8_t station, const Misbehaviour& faults);
    Misbehaviour faults(std::uint8_t station) const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::sim
