#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/leaving.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::mqtt {

/// Says at the broker what the publisher has to say, and connects again and again. What the broker
/// has not acknowledged when a connection is lost is said again, in its order. One thread, nothing
/// waits; clock and publisher outlive it.
class Client {
  public:
    /// Called from the loop, never from inside the calls below.
    using OnCommand = std::function<void(const Command&)>;

    Client(boost::asio::any_io_executor executor, rt::Clock& clock, const Settings& settings,
           Publisher& publisher, OnCommand on_command);
    ~Client();
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    void start();
    /// Takes leave of the broker; what is given keeps the connection for that long. Null: there is
    /// none.
    std::unique_ptr<Leaving> stop();
    /// The publisher has something new.
    void wake();

    /// All but what comes of writes.
    Counters counters() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::mqtt
