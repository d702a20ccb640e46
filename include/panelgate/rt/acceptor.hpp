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

/// When a peer that has gone without a word is given up: so many probes after a silence.
struct KeepAlive {
    std::chrono::seconds silence;
    std::chrono::seconds pause;  ///< between two probes
    int probes = 3;
};

/// Small writes leave at once, and a peer that is gone is noticed (CON-07). What cannot be set is
/// no reason to refuse a connection.
void set_up_socket(int socket, const KeepAlive& keep_alive);

/// Which peers may connect (CON-06). An IPv4 peer matches IPv4 networks whether the socket shows it
/// as IPv4 or as v4-mapped IPv6; ::/0 is everybody. Pure.
class AccessList {
  public:
    /// An empty list allows everybody. Throws std::invalid_argument for what is not a network.
    explicit AccessList(const std::vector<Network>& allowed);

    bool allows(const boost::asio::ip::address& peer) const;

  private:
    struct Entry {
        AddressBytes address;  ///< IPv4 as v4-mapped
        unsigned prefix;       ///< 0..128
    };
    std::vector<Entry> allowed_;
};

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
