#include "panelgate/base/network.hpp"

#include <algorithm>
#include <cstddef>

namespace panelgate {

bool same_prefix(const AddressBytes& left, const AddressBytes& right, unsigned bits) {
    const auto whole = static_cast<std::ptrdiff_t>(bits / 8);
    if (!std::equal(left.begin(), left.begin() + whole, right.begin())) return false;
    if (bits % 8 == 0) return true;
    const unsigned mask = (0xFF00U >> (bits % 8)) & 0xFFU;
    const auto at = static_cast<std::size_t>(whole);
    return ((left[at] ^ right[at]) & mask) == 0;
}

}  // namespace panelgate
