#include "http_door.hpp"

#include <optional>

#include "load.hpp"
#include "reachable.hpp"

namespace panelgate::app {
namespace {

std::variant<config::Endpoint, NoDoor> door_of(const std::string& file) {
    const std::optional<config::Config> config = read_quietly(file);
    const web::Settings usual;
    if (!config) return config::Endpoint{usual.address, usual.port};
    if (config->http && config->http->port != 0)
        return config::Endpoint{config->http->address, config->http->port};
    return NoDoor{file +
                  (config->http ? " lets http listen on any free port"
                                : " has no http, so nobody can be asked") +
                  "; --http ADDR:PORT says where"};
}

}  // namespace

std::variant<config::Endpoint, NoDoor> http_door(const std::string& file, const std::string& http) {
    auto door = door_of(file);
    if (!http.empty()) {
        const auto asked = config::parse_endpoint(http);
        if (!asked || asked->port == 0)
            return NoDoor{"--http '" + http + "' is not ADDR:PORT, such as 127.0.0.1:8080", kUsage};
        door = *asked;
    }
    if (auto* endpoint = std::get_if<config::Endpoint>(&door))
        endpoint->address = reachable(endpoint->address);
    return door;
}

}  // namespace panelgate::app
