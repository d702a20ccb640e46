#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::mqtt {

/// A connection that is being closed gracefully: it is closed at once when this ends.
class GracefulClose {
  public:
    virtual ~GracefulClose() = default;
    virtual bool done() const = 0;
};

/// Publishes the publisher's messages and reconnects forever. Unacknowledged messages of a lost
/// connection are sent again in order. Single-threaded and non-blocking; clock and publisher must
/// outlive it.
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
    /// Disconnects from the broker; the returned object keeps the connection until that is done.
    /// Null if not connected.
    std::shared_ptr<GracefulClose> stop();
    /// Must be called when the publisher has new messages.
    void wake();

    /// Files of the settings that are used by the next connection.
    void renew(const tls::Material& files);

    /// Returns all counters except those of write outcomes.
    Counters counters() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::mqtt
