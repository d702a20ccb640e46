#include "panelgate/base/network.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <algorithm>
#include <array>
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

std::string_view without_mapping(std::string_view address) {
    constexpr std::string_view kMapped = "::ffff:";
    const bool mapped = address.starts_with(kMapped) && address.find('.') != address.npos;
    return mapped ? address.substr(kMapped.size()) : address;
}

HostKey::HostKey(std::string_view address) : text_(without_mapping(address)) {
    in6_addr bytes{};
    const std::string bare = text_.substr(0, text_.find('%'));
    if (::inet_pton(AF_INET6, bare.c_str(), &bytes) != 1 || IN6_IS_ADDR_LOOPBACK(&bytes)) return;
    std::fill(std::begin(bytes.s6_addr) + 8, std::end(bytes.s6_addr), std::uint8_t{0});
    std::array<char, INET6_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET6, &bytes, text.data(), text.size());
    text_ = std::string(text.data()) + "/64";
}

namespace {

/// A word without port and brackets.
std::string_view host_in(std::string_view word) {
    if (word.starts_with('[')) return word.substr(1, word.find(']') - 1);
    const auto colon = word.find(':');
    const bool has_port = colon != word.npos && word.find(':', colon + 1) == word.npos;
    return has_port ? word.substr(0, colon) : word;
}

/// Also of a whole network, as HostKey has it.
bool is_address(std::string_view text) {
    std::array<std::uint8_t, sizeof(in6_addr)> bytes{};
    const std::string bare(text.substr(0, text.find_first_of("%/")));
    return ::inet_pton(AF_INET, bare.c_str(), bytes.data()) == 1 ||
           ::inet_pton(AF_INET6, bare.c_str(), bytes.data()) == 1;
}

/// The word of a client's name that holds the address; empty: no word does.
std::string_view endpoint_in(std::string_view client) {
    for (int word = 0; word < 2 && !client.empty(); ++word) {
        const std::string_view one = client.substr(0, client.find(' '));
        if (is_address(host_in(one))) return one;
        client.remove_prefix(std::min(one.size() + 1, client.size()));
    }
    return {};
}

}  // namespace

std::string_view address_in(std::string_view client) { return host_in(endpoint_in(client)); }

std::string name_of_host(std::string_view client) {
    const std::string_view endpoint = endpoint_in(client);
    if (endpoint.empty()) return std::string(client);
    const auto begin = static_cast<std::size_t>(endpoint.data() - client.data());
    return std::string(client.substr(0, begin)) + HostKey(host_in(endpoint)).text() +
           std::string(client.substr(begin + endpoint.size()));
}

}  // namespace panelgate
