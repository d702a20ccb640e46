#include "panelgate/config/endpoint.hpp"

#include <arpa/inet.h>
#include <algorithm>
#include <array>
#include <cstddef>
#include <tuple>

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

/// Clears what comes behind the first bits of an address.
void clear_behind(AddressBytes& bytes, std::size_t bits) {
    for (std::size_t bit = bits; bit < 8 * bytes.size(); ++bit)
        bytes.at(bit / 8) &= static_cast<unsigned char>(~(0x80U >> (bit % 8)));
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

std::string network_text(const Network& network) {
    return network.address + '/' + std::to_string(network.prefix);
}

std::string network_of(const Network& typed) {
    AddressBytes bytes{};
    const int family = is_ipv6(typed.address) ? AF_INET6 : AF_INET;
    if (inet_pton(family, typed.address.c_str(), bytes.data()) != 1) return "";
    const AddressBytes before = bytes;
    clear_behind(bytes, typed.prefix);
    if (bytes == before) return "";
    std::array<char, INET6_ADDRSTRLEN> text{};
    inet_ntop(family, bytes.data(), text.data(), text.size());
    return network_text({text.data(), typed.prefix});
}

bool is_in(const std::string& address, const std::string& network, unsigned prefix) {
    const auto one = as_v6(address);
    const auto other = as_v6(network);
    const unsigned bits = is_ipv6(network) ? prefix : prefix + 96;
    return one && other && same_prefix(*one, *other, bits);
}

bool covers(const Network& wide, const Network& narrow) {
    const auto bits = [](const Network& network) {
        return is_ipv6(network.address) ? network.prefix : 96 + network.prefix;
    };
    return bits(wide) <= bits(narrow) && is_in(narrow.address, wide.address, wide.prefix);
}

bool is_loopback(const std::string& address) {
    return is_in(address, "127.0.0.0", 8) || is_in(address, "::1", 128);
}

namespace {

/// A network of either family: the first bits of an IPv6 address.
struct Block {
    AddressBytes first{};
    unsigned bits = 0;

    bool holds(const Block& other) const {
        return bits <= other.bits && same_prefix(first, other.first, bits);
    }
};

constexpr Block kAllOfIpv6{};
/// ::ffff:0:0/96 (RFC 4291, 2.5.5.2)
constexpr Block kAllOfIpv4{{{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 0, 0}}, 96};

/// Returns the networks without those that another one holds, sorted.
std::vector<Block> outermost(const std::vector<Network>& networks) {
    std::vector<Block> all;
    for (const Network& network : networks) {
        const auto address = as_v6(network.address);
        if (!address) continue;
        Block block{*address, is_ipv6(network.address) ? network.prefix : network.prefix + 96};
        clear_behind(block.first, block.bits);
        all.push_back(block);
    }
    std::ranges::sort(all, [](const Block& left, const Block& right) {
        return std::tie(left.first, left.bits) < std::tie(right.first, right.bits);
    });
    std::vector<Block> kept;
    for (const Block& block : all) {
        if (kept.empty() || !kept.back().holds(block)) kept.push_back(block);
    }
    return kept;
}

/// Networks of a plant or an operator: RFC 1918, 6598, 3927, 4193, and 4291 for fe80::.
bool is_private(const Block& block) {
    static const std::vector<Block> kPrivate = outermost({{"10.0.0.0", 8},
                                                          {"100.64.0.0", 10},
                                                          {"127.0.0.0", 8},
                                                          {"169.254.0.0", 16},
                                                          {"172.16.0.0", 12},
                                                          {"192.168.0.0", 16},
                                                          {"fc00::", 7},
                                                          {"fe80::", 10}});
    return std::ranges::any_of(kPrivate, [&](const Block& one) { return one.holds(block); });
}

/// Returns which part of a family's addresses the public ones of these networks are.
double public_share(const std::vector<Block>& networks, const Block& family) {
    double share = 0;
    for (const Block& network : networks) {
        if (network.holds(family)) return 1;
        if (!family.holds(network) || is_private(network)) continue;
        share += std::ldexp(1.0, static_cast<int>(family.bits) - static_cast<int>(network.bits));
    }
    return share;
}

}  // namespace

bool is_reachable_from_outside(const std::string& address, const std::vector<Network>& allow) {
    constexpr double kMostOfIpv4 = 1.0 / (1 << 8);
    constexpr double kMostOfIpv6 = 1.0 / (1 << 16);
    if (is_loopback(address)) return false;
    if (allow.empty()) return true;
    const std::vector<Block> networks = outermost(allow);
    const bool is_ipv4 = is_in(address, "0.0.0.0", 0);
    const bool takes_ipv4 = is_ipv4 || is_any_address(address);  // "::" takes both families
    return (takes_ipv4 && public_share(networks, kAllOfIpv4) > kMostOfIpv4) ||
           (!is_ipv4 && public_share(networks, kAllOfIpv6) > kMostOfIpv6);
}

std::optional<Network> parse_cidr(std::string_view text) {
    const std::size_t slash = text.find('/');
    Network cidr{std::string(text.substr(0, slash)), 0};
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
