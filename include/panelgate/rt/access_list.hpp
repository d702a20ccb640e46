#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstdint>
#include <vector>

#include "panelgate/base/network.hpp"

namespace panelgate::rt {

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

}  // namespace panelgate::rt
