#include <arpa/inet.h>
#include <netinet/in.h>
#include <algorithm>
#include <array>
#include <cstring>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/network.hpp"

namespace panelgate::access {

namespace {

constexpr unsigned kMappedBits = 96;  ///< before an IPv4 address in IPv6 (RFC 4291, 2.5.5.2)

struct Parsed {
    AddressBytes bytes{};
    bool four = false;
};

std::optional<Parsed> parse(std::string text) {
    text.resize(std::min(text.find('%'), text.size()));  // a zone
    Parsed parsed;
    in6_addr six{};
    if (::inet_pton(AF_INET6, text.c_str(), &six) == 1) {
        std::memcpy(parsed.bytes.data(), &six, sizeof six);
        return parsed;
    }
    in_addr four{};
    if (::inet_pton(AF_INET, text.c_str(), &four) != 1) return std::nullopt;
    parsed.four = true;
    parsed.bytes[10] = parsed.bytes[11] = 0xFF;
    std::memcpy(parsed.bytes.data() + kMappedBits / 8, &four, sizeof four);
    return parsed;
}

/// ::/0 holds every address, as in the lists of listeners.
bool holds(const Network& network, const Parsed& address) {
    const auto base = parse(network.address);
    if (!base) return false;
    return same_prefix(base->bytes, address.bytes,
                       network.prefix + (base->four ? kMappedBits : 0U));
}

bool comes_from(const Rule& rule, const Who& who) {
    if (rule.from.empty()) return true;
    const auto address = parse(who.address);
    return address && std::ranges::any_of(rule.from, [&](const Network& network) {
               return holds(network, *address);
           });
}

/// A token counts more than a certificate (docs/operate/tls.md). Of that the words count, too: the
/// gateway may not have such a role.
bool has_role(const Rule& rule, const Who& who) {
    return rule.roles.empty() || std::ranges::any_of(rule.roles, [&](const std::string& role) {
               return role == who.standing.name() ||
                      (who.token.empty() && role == who.certificate_role);
           });
}

bool comes_in_by(const Rule& rule, Face face) {
    if (face == Face::udp) face = Face::modbus_tcp;
    return rule.faces.empty() || std::ranges::find(rule.faces, face) != rule.faces.end();
}

bool is_among(const std::vector<std::string>& list, const std::string& name) {
    return list.empty() || std::ranges::find(list, name) != list.end();
}

}  // namespace

bool is_about(const Rule& rule, const Who& who) {
    return comes_in_by(rule, who.face) && is_among(rule.tokens, who.token) &&
           is_among(rule.listeners, who.listener) && has_role(rule, who) && comes_from(rule, who);
}

Right right_of(Act act) {
    constexpr std::array kRights{Right::read, Right::write, Right::broadcast, Right::raw};
    return kRights.at(static_cast<std::size_t>(act));
}

std::string_view label(Act act) {
    constexpr std::array<std::string_view, 4> kLabels{"read", "write", "broadcast", "raw"};
    return kLabels.at(static_cast<std::size_t>(act));
}

}  // namespace panelgate::access
