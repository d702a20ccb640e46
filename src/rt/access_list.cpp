#include "panelgate/rt/access_list.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace panelgate::rt {
namespace {

namespace ip = boost::asio::ip;

AddressBytes as_v6(const ip::address& address) {
    if (address.is_v6()) return address.to_v6().to_bytes();
    return ip::make_address_v6(ip::v4_mapped, address.to_v4()).to_bytes();
}

}  // namespace

AccessList::AccessList(const std::vector<Network>& allowed) {
    for (const Network& network : allowed) {
        boost::system::error_code error;
        const ip::address address = ip::make_address(network.address, error);
        const unsigned widest = !error && address.is_v4() ? 32 : 128;
        if (error || network.prefix > widest) {
            throw std::invalid_argument("not a network: " + network.address + "/" +
                                        std::to_string(network.prefix));
        }
        allowed_.push_back({as_v6(address), network.prefix + (128 - widest)});
    }
}

bool AccessList::allows(const ip::address& peer) const {
    if (allowed_.empty()) return true;
    const AddressBytes address = as_v6(peer);
    return std::ranges::any_of(allowed_, [&](const Entry& entry) {
        return same_prefix(address, entry.address, entry.prefix);
    });
}

}  // namespace panelgate::rt
