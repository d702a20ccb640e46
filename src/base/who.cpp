#include "panelgate/base/who.hpp"

#include <cstdlib>
#include <functional>
#include <utility>

#include "panelgate/base/network.hpp"

namespace panelgate {

std::string_view label(Face face) {
    switch (face) {
        case Face::modbus_tcp:
            return "modbus_tcp";
        case Face::udp:
            return "udp";
        case Face::serial_master:
            return "serial_master";
        case Face::http:
            return "http";
        case Face::mqtt:
            return "mqtt";
        case Face::gateway:
            return "gateway";
    }
    std::abort();
}

std::uint64_t host_number(std::string_view address) {
    const auto number = std::hash<std::string>{}(HostKey(address).text());
    return number == 0 ? 1 : number;
}

WhoRef make_who(Who who) {
    who.address = std::string(without_mapping(who.address));
    if (!who.address.empty()) who.host = host_number(who.address);
    return std::make_shared<const Who>(std::move(who));
}

WhoRef own_task(std::string name) {
    return make_who({.face = Face::gateway, .name = std::move(name), .standing = Role::admin});
}

std::string text_of(const WhoRef& who) { return who ? who->name : "a client without a name"; }

}  // namespace panelgate
