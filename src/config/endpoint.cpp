#include "panelgate/config/endpoint.hpp"

#include <arpa/inet.h>
#include <algorithm>
#include <array>

#include "panelgate/base/network.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

namespace {

/// Returns 32 or 128 for an address of that family, 0 for anything else.
unsigned bits_of_address(const std::string& text) {
    std::array<unsigned char, 16> buffer{};
    if (inet_pton(AF_INET, text.c_str(), buffer.data()) == 1) return 32;
    if (inet_pton(AF_INET6, text.c_str(), buffer.data()) == 1) return 128;
    return 0;
}

/// ::ffff:10.0.0.1 (RFC 4291, 2.5.5.2)
bool is_mapped(const std::string& address) {
    constexpr std::array<unsigned char, 12> kMapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
    std::array<unsigned char, 16> buffer{};
    return inet_pton(AF_INET6, address.c_str(), buffer.data()) == 1 &&
           std::equal(kMapped.begin(), kMapped.end(), buffer.begin());
}

/// Maps IPv4 to ::ffff:10.0.0.1; returns nothing for invalid text.
std::optional<AddressBytes> as_v6(const std::string& address) {
    AddressBytes bytes{};
    if (inet_pton(AF_INET6, address.c_str(), bytes.data()) == 1) return bytes;
    bytes[10] = bytes[11] = 0xFF;
    if (inet_pton(AF_INET, address.c_str(), bytes.data() + 12) == 1) return bytes;
    return std::nullopt;
}

}  // namespace

std::optional<Endpoint> parse_endpoint(std::string_view text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    const auto port = yaml::parse_integer(text.substr(colon + 1));
    std::string address(text.substr(0, colon));
    const bool bracketed = address.size() > 2 && address.front() == '[' && address.back() == ']';
    if (bracketed) address = address.substr(1, address.size() - 2);
    const unsigned bits = bits_of_address(address);
    if (!port || *port < 0 || *port > 65535 || bits == 0 || bracketed != (bits == 128))
        return std::nullopt;
    return Endpoint{std::move(address), static_cast<std::uint16_t>(*port)};
}

bool is_ipv6(const std::string& address) { return bits_of_address(address) == 128; }

bool is_any_address(const std::string& address) {
    std::array<unsigned char, 16> buffer{};
    const int family = is_ipv6(address) ? AF_INET6 : AF_INET;
    return inet_pton(family, address.c_str(), buffer.data()) == 1 &&
           std::ranges::all_of(buffer, [](unsigned char byte) { return byte == 0; });
}

std::string network_of(const Cidr& cidr) {
    std::array<unsigned char, 16> bytes{};
    const int family = is_ipv6(cidr.address) ? AF_INET6 : AF_INET;
    if (inet_pton(family, cidr.address.c_str(), bytes.data()) != 1) return "";
    const auto typed = bytes;
    for (std::size_t bit = cidr.prefix; bit < 8 * bytes.size(); ++bit)
        bytes.at(bit / 8) &= static_cast<unsigned char>(~(0x80U >> (bit % 8)));
    if (bytes == typed) return "";
    std::array<char, INET6_ADDRSTRLEN> text{};
    inet_ntop(family, bytes.data(), text.data(), text.size());
    return std::string(text.data()) + '/' + std::to_string(cidr.prefix);
}

bool is_in(const std::string& address, const std::string& network, unsigned prefix) {
    const auto one = as_v6(address);
    const auto other = as_v6(network);
    const unsigned bits = is_ipv6(network) ? prefix : prefix + 96;
    return one && other && same_prefix(*one, *other, bits);
}

std::optional<Cidr> parse_cidr(std::string_view text) {
    const std::size_t slash = text.find('/');
    Cidr cidr{std::string(text.substr(0, slash)), 0};
    const unsigned bits = bits_of_address(cidr.address);
    if (bits == 0) return std::nullopt;
    cidr.prefix = bits;
    if (slash == std::string_view::npos) return cidr;
    const auto prefix = yaml::parse_integer(text.substr(slash + 1));
    if (!prefix || *prefix < 0 || *prefix > bits) return std::nullopt;
    if (is_mapped(cidr.address) && *prefix < 96) return std::nullopt;
    cidr.prefix = static_cast<unsigned>(*prefix);
    return cidr;
}

}  // namespace panelgate::config
