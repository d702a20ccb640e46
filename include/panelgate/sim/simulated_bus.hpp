#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::sim {

struct Settings {
    SerialFormat serial;
    Duration think_time = 1ms;  ///< of a panel, after the silence that ends the request
};

/// Panels on one RS-485 line behind a pseudo-terminal, paced at the line's baud: a request is whole
/// after its wire time and t3.5 of silence, the reply's bytes arrive when a real line would bring
/// them. What is sent while a reply is under way collides and is lost, as on a real line.
class SimulatedBus {
  public:
    /// Throws std::system_error when there is no pty left. The stations' profiles must outlive it.
    SimulatedBus(boost::asio::any_io_executor executor, Settings settings,
                 std::vector<Station> stations);
    ~SimulatedBus();

    /// What a gateway opens: the path of the pty.
    const std::string& device() const;
    void start();
    void stop();

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::sim
