#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/network.hpp"

namespace panelgate::rt {

/// TCP keep-alive: when a silent peer is dropped, after how many unanswered probes.
struct KeepAlive {
    std::chrono::seconds silence;
    std::chrono::seconds pause;  ///< between two probes
    int probes = 3;
};

/// Sets TCP_NODELAY and keep-alive: small writes leave at once, and a dead peer is noticed
/// (CON-07). Errors are ignored: the connection works without.
void set_up_socket(int socket, const KeepAlive& keep_alive);

/// Which peers may connect (CON-06). An IPv4 peer matches IPv4 networks also as v4-mapped IPv6;
/// ::/0 matches every peer. Pure.
class AccessList {
  public:
    /// An empty list allows every peer. Throws std::invalid_argument for an invalid network.
    explicit AccessList(const std::vector<Network>& allowed);

    bool allows(const boost::asio::ip::address& peer) const;

  private:
    struct Entry {
        AddressBytes address;  ///< IPv4 as v4-mapped
        unsigned prefix;       ///< 0..128
    };
    std::vector<Entry> allowed_;
};

/// Listens on one TCP port and passes on each connection. Single-threaded; handlers run on the
/// executor, and never after close().
class Acceptor {
  public:
    using Accepted = std::function<void(boost::asio::ip::tcp::socket socket)>;
    /// accept() fails, mostly for want of descriptors: called once until it works again. It is
    /// retried after a pause.
    using Failing = std::function<void(const boost::system::error_code& why)>;

    Acceptor(const boost::asio::any_io_executor& executor, Accepted accepted, Failing failing);
    ~Acceptor();  ///< as close()
    Acceptor(const Acceptor&) = delete;
    Acceptor& operator=(const Acceptor&) = delete;

    /// Binds and starts to accept; port 0 picks a free port. Returns the error, if any; open() may
    /// then be called again. "::" takes IPv4 as well, unless `ipv6_only`.
    boost::system::error_code open(const std::string& address, std::uint16_t port,
                                   bool ipv6_only = false);
    /// Returns the bound port; 0 while closed.
    std::uint16_t port() const;
    boost::asio::any_io_executor get_executor() const;
    void close();

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with pending completions
};

}  // namespace panelgate::rt
