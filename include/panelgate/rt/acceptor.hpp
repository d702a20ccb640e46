#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace panelgate::rt {

/// Listens on one TCP port and hands over whoever comes. One thread; handlers are called from the
/// executor, and not any more after close().
class Acceptor {
  public:
    using Accepted = std::function<void(boost::asio::ip::tcp::socket socket)>;
    /// Nobody can be accepted, mostly for want of descriptors: told once until it is over. It is
    /// tried again after a pause.
    using Failing = std::function<void(const boost::system::error_code& why)>;

    Acceptor(const boost::asio::any_io_executor& executor, Accepted accepted, Failing failing);
    ~Acceptor();  ///< as close()
    Acceptor(const Acceptor&) = delete;
    Acceptor& operator=(const Acceptor&) = delete;

    /// Binds and accepts; port 0: any that is free. What is wrong, or nothing: then it may be tried
    /// again. "::" takes IPv4 as well, unless `ipv6_only`.
    boost::system::error_code open(const std::string& address, std::uint16_t port,
                                   bool ipv6_only = false);
    /// The port it is bound to; 0 while it is closed.
    std::uint16_t port() const;
    boost::asio::any_io_executor get_executor() const;
    void close();

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with completions that are still under way
};

}  // namespace panelgate::rt
