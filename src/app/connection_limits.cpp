#include "connection_limits.hpp"

#include <algorithm>
#include <vector>

#include "panelgate/rt/descriptors.hpp"

namespace panelgate::app {
namespace {

/// `max_connections` of every listener, by the order of the configuration; the last is HTTP's.
std::vector<std::size_t*> maxima(config::Config& config) {
    std::vector<std::size_t*> found;
    for (tcp_server::Settings& settings : config.modbus_tcp)
        found.push_back(&settings.max_connections);
    if (config.http) found.push_back(&config.http->max_connections);
    return found;
}

std::string words(const config::Config& config, const std::vector<std::size_t>& granted) {
    std::string text;
    std::size_t at = 0;
    const auto add = [&](const std::string& listener) {
        if (!text.empty()) text += ", ";
        text += listener + " " + std::to_string(granted[at++]);
    };
    for (const tcp_server::Settings& settings : config.modbus_tcp) add(settings.name());
    if (config.http) add("http " + config.http->name());
    return text;
}

}  // namespace

std::string fit_connections(config::Config& config, std::size_t limit) {
    const std::size_t wanted =
        kOwnDescriptors +
        kDescriptorsPerLine * (config.lines.size() + config.serial_masters.size());
    // Of few, clients have a quarter: the gateway seldom needs all that is kept back.
    const std::size_t reserve = std::min(wanted, limit - limit / 4);
    std::vector<std::size_t> asked;
    for (const std::size_t* most : maxima(config)) asked.push_back(*most);
    const auto granted = rt::share_descriptors(limit - reserve, asked);
    if (granted == asked) return {};
    std::size_t at = 0;
    for (std::size_t* most : maxima(config)) *most = granted[at++];
    return words(config, granted);
}

}  // namespace panelgate::app
