#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/base/time.hpp"
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

}  // namespace panelgate::mqtt
