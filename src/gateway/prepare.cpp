#include "panelgate/gateway/prepare.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "panelgate/config/endpoint.hpp"
#include "panelgate/explain/capacity.hpp"
#include "panelgate/explain/inventory.hpp"
#include "panelgate/gateway/certificates.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

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
    ports_of_four.erase(0);  // port 0: any free one, never shared
    for (tcp_server::Settings& settings : config.modbus_tcp) separate(settings, ports_of_four);
    if (config.http) separate(*config.http, ports_of_four);
}

namespace {

/// `max_connections` of every listener, in the order of the configuration; HTTP's is the last.
std::vector<std::size_t*> maxima(config::Config& config) {
    std::vector<std::size_t*> found;
    for (tcp_server::Settings& settings : config.modbus_tcp)
        found.push_back(&settings.max_connections);
    if (config.http) found.push_back(&config.http->max_connections);
    return found;
}

/// At the same time, of all listeners: they have no place yet.
std::size_t handshakes(const config::Config& config) {
    std::size_t most = 0;
    const auto add = [&](const std::optional<tls::Settings>& tls) {
        if (tls) most += tls->max_handshakes;
    };
    for (const tcp_server::Settings& settings : config.modbus_tcp) add(settings.tls);
    if (config.http) add(config.http->tls);
    return most;
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
        kDescriptorsPerLine * (config.lines.size() + config.serial_masters.size()) +
        handshakes(config);
    // Of few descriptors clients get a quarter: the gateway seldom needs all of its reserve.
    const std::size_t reserve = std::min(wanted, limit - limit / 4);
    std::vector<std::size_t> asked;
    for (const std::size_t* most : maxima(config)) asked.push_back(*most);
    const auto granted = rt::share_descriptors(limit - reserve, asked);
    if (granted == asked) return {};
    std::size_t at = 0;
    for (std::size_t* most : maxima(config)) *most = granted[at++];
    return words(config, granted);
}

namespace {

/// Must run before the first listener is opened.
std::string fit_to_descriptors(config::Config& config) {
    const std::size_t limit = rt::raise_descriptor_limit();
    const std::string lowered = fit_connections(config, limit);
    if (lowered.empty()) return {};
    return "to " + lowered + ": this process may open " + std::to_string(limit) +
           " files (LimitNOFILE of the service, ulimit -Hn)";
}

}  // namespace

std::int64_t seconds_since_1970() {
    const auto now = rt::wall_now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

std::vector<StartMessage> prepare(config::Config& config) {
    separate_families(config);
    std::vector<StartMessage> messages;
    for (const std::string& warning : config.warnings)
        messages.push_back({"configuration", warning});
    for (const explain::Capacity& line : explain::capacities(config)) {
        for (const std::string& warning : line.warnings)
            messages.push_back({"planned requests", warning});
        if (plan::verdict(line.plan) != plan::Verdict::fine)
            messages.push_back({"planned load", overload_text(line)});
    }
    for (std::string& doubt : certificate_doubts(config, seconds_since_1970()))
        messages.push_back({"certificate", std::move(doubt)});
    if (std::string lowered = fit_to_descriptors(config); !lowered.empty())
        messages.push_back({"max_connections lowered", std::move(lowered)});
    return messages;
}

std::string shown_text(const config::Config& config) {
    return web::json_text(explain::inventory_json(config));
}

}  // namespace panelgate::gateway
