#include "http_door.hpp"

#include <optional>

#include "load.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/document.hpp"
#include "reachable.hpp"

namespace panelgate::app {
namespace {

config::Endpoint usual() {
    const web::Settings settings;
    return {settings.address, settings.port};
}

/// The `listen` of `http` in a file whatever else is wrong with it; nothing where it has none.
std::optional<config::Endpoint> listen_in(const std::string& file) {
    const auto text = config::RealFiles::read_any(path_of(file));
    if (!text) return std::nullopt;
    yaml::Problems ignored(file);
    const yaml::Node tree = yaml::parse(*text, ignored);
    for (const yaml::Entry& top : tree.entries) {
        if (top.key != "http") continue;
        for (const yaml::Entry& entry : top.value.entries) {
            const auto door =
                entry.key == "listen" ? config::parse_endpoint(entry.value.scalar) : std::nullopt;
            if (door && door->port != 0) return door;
        }
    }
    return std::nullopt;
}

std::variant<config::Endpoint, NoDoor> door_of(const std::string& file) {
    const std::optional<config::Config> config = read_quietly(file);
    if (!config) return listen_in(file).value_or(usual());
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
