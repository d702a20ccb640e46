#include "panelgate/rt/access_list.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace panelgate::rt {
namespace {

namespace ip = boost::asio::ip;
using Address = std::array<std::uint8_t, 16>;

Address as_v6(const ip::address& address) {
    if (address.is_v6()) return address.to_v6().to_bytes();
    return ip::make_address_v6(ip::v4_mapped, address.to_v4()).to_bytes();
}

bool same_prefix(const Address& left, const Address& right, unsigned bits) {
    const auto whole = static_cast<std::ptrdiff_t>(bits / 8);
    if (!std::equal(left.begin(), left.begin() + whole, right.begin())) return false;
    if (bits % 8 == 0) return true;
    const unsigned mask = (0xFF00U >> (bits % 8)) & 0xFFU;
    const auto at = static_cast<std::size_t>(whole);
    return ((left[at] ^ right[at]) & mask) == 0;
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
    const Address address = as_v6(peer);
    return std::ranges::any_of(allowed_, [&](const Entry& entry) {
        return same_prefix(address, entry.address, entry.prefix);
    });
}

}  // namespace panelgate::rt
