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

class Connection;

/// The end of a connection that has said its last word: what is still to be sent goes out, and the
/// socket stays until the broker has closed it. To close one into which the broker still writes
/// would reset the connection, and what the broker has not read yet, the last word with it, would
/// be lost.
class Leaving {
  public:
    /// Owns the socket. `within`: then it is closed all the same. The clock outlives this.
    Leaving(boost::asio::any_io_executor executor, int socket, rt::Clock& clock,
            std::shared_ptr<Connection> connection, Duration within);
    /// Closes it.
    ~Leaving();
    Leaving(const Leaving&) = delete;
    Leaving& operator=(const Leaving&) = delete;

    bool done() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

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
