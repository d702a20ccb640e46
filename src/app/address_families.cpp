#include "address_families.hpp"

#include <cstdint>
#include <set>
#include <string>

#include "panelgate/config/endpoint.hpp"

namespace panelgate::app {
namespace {

template <class Settings>
void separate(Settings& settings, const std::set<std::uint16_t>& ports_of_four) {
    const bool all_of_six =
        config::is_any_address(settings.address) && config::is_ipv6(settings.address);
    settings.ipv6_only = all_of_six && ports_of_four.contains(settings.port);
}

}  // namespace

void separate_families(config::Config& config) {
    std::set<std::uint16_t> ports_of_four;
    for (const tcp_server::Settings& settings : config.modbus_tcp)
        if (!config::is_ipv6(settings.address)) ports_of_four.insert(settings.port);
    if (config.http && !config::is_ipv6(config.http->address))
        ports_of_four.insert(config.http->port);
    ports_of_four.erase(0);  // any free one: never the same
    for (tcp_server::Settings& settings : config.modbus_tcp) separate(settings, ports_of_four);
    if (config.http) separate(*config.http, ports_of_four);
}

}  // namespace panelgate::app
