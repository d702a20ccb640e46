#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "panelgate/config/endpoint.hpp"
#include "panelgate/rt/acceptor.hpp"

namespace panelgate::app {

/// Offers a pty as a serial device server would: RTU frames over TCP, one client at a time; a new
/// one takes the place of the old. One thread.
class TcpBridge {
  public:
    /// Listens. Throws std::system_error.
    TcpBridge(const boost::asio::any_io_executor& executor, const config::Endpoint& endpoint,
              const std::string& device);
    ~TcpBridge();
    TcpBridge(const TcpBridge&) = delete;
    TcpBridge& operator=(const TcpBridge&) = delete;

    std::uint16_t port() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
    rt::Acceptor acceptor_;
};

}  // namespace panelgate::app
