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

/// Panels on one RS-485 line behind a pseudo-terminal, paced at the line's baud: a request is whole
/// after its wire time and t3.5 of silence, the reply's bytes arrive when a real line would bring
/// them. A pause inside a request is noticed by panels that mind it (GT: 24 bit times). Each panel
/// thinks on its own, and hears nothing meanwhile; who speaks at the same time as another damages
/// both, as on a real line.
class SimulatedBus {
  public:
    /// Throws std::system_error when there is no pty left. The clock and the stations' profiles
    /// must outlive it.
    SimulatedBus(boost::asio::any_io_executor executor, rt::Clock& clock, Settings settings,
                 std::vector<Station> stations);
    ~SimulatedBus();

    /// What a gateway opens: the path of the pty.
    const std::string& device() const;
    void start();
    void stop();

    bool has(std::uint8_t station) const;
    /// From the next request on.
    void set_faults(std::uint8_t station, const Misbehaviour& faults);
    Misbehaviour faults(std::uint8_t station) const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::sim
