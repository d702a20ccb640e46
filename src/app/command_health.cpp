#include <iostream>
#include <optional>
#include <string>
#include <variant>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "reachable.hpp"
#include "readiness.hpp"

namespace panelgate::app {
namespace {

constexpr Duration kPatience = 2s;

/// Where the gateway of this file listens, or why nobody can know. What a file that is not there or
/// has faults would say is the default: a gateway that runs has read another one.
std::variant<config::Endpoint, std::string> door_of(const std::string& file) {
    const std::optional<config::Config> config = read_quietly(file);
    const web::Settings usual;
    if (!config) return config::Endpoint{usual.address, usual.port};
    if (config->http && config->http->port != 0)
        return config::Endpoint{config->http->address, config->http->port};
    return file +
           (config->http ? " lets http listen on any free port"
                         : " has no http, so nobody can be asked") +
           "; --http ADDR:PORT says where";
}

}  // namespace

ExitCode health(const std::string& file, const std::string& http) {
    std::optional<config::Endpoint> asked;
    if (http.empty()) {
        const auto door = door_of(file);
        if (const auto* why = std::get_if<std::string>(&door)) {
            std::cerr << "panelgate: not ready: " << *why << '\n';
            return kNotReady;
        }
        asked = std::get<config::Endpoint>(door);
    } else {
        asked = config::parse_endpoint(http);
        if (!asked || asked->port == 0) {
            std::cerr << "panelgate: --http '" << http
                      << "' is not ADDR:PORT, such as 127.0.0.1:8080\n";
            return kUsage;
        }
    }
    const std::string address = reachable(asked->address);
    const std::string why = ask_whether_ready(address, asked->port, kPatience);
    if (why.empty()) return kFine;
    std::cerr << "panelgate: not ready: http://" << endpoint_text(address, asked->port)
              << "/readyz: " << why << '\n';
    return kNotReady;
}

}  // namespace panelgate::app
