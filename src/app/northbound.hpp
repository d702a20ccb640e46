#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "broker_session.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/rt/clock.hpp"
#include "scene.hpp"

namespace panelgate::app {

/// What is served at the plant's broker, through all reloads. The clock outlives it. One thread.
class Northbound {
  public:
    Northbound(boost::asio::any_io_executor executor, rt::Clock& clock);

    /// From now on this; without `mqtt:` nothing. Where broker, points and stations are the same,
    /// the connection stays; else it is made anew, and what waited is kept.
    void show(const std::shared_ptr<const Scene>& scene);
    void start();
    /// Says the last word. Harmless when it was said.
    void stop();
    /// The broker has heard that last word, or it is not waited for any more.
    bool left() const { return !leaving_ || leaving_->done(); }

    /// Of the lines of the scene.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    /// Nothing without a broker.
    std::optional<mqtt::Counters> counters() const;

  private:
    void leave();

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<BrokerSession> session_;  ///< null without a broker
    std::unique_ptr<mqtt::Leaving> leaving_;  ///< of the session before, or of the last
    bool running_ = false;
};

}  // namespace panelgate::app
