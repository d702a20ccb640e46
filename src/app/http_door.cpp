#include "http_door.hpp"

#include <optional>

#include "commands.hpp"
#include "listen_in_text.hpp"
#include "load.hpp"
#include "panelgate/config/reachable.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::app {
namespace {

config::Endpoint usual() {
    const web::Settings settings;
    return {settings.address, settings.port};
}

std::variant<config::Endpoint, NoDoor> no_door(const std::string& why, ExitCode code = kNotReady) {
    return NoDoor{why + "; --http ADDR:PORT says where", code};
}

/// What is typed behind http's `listen`: nothing where there is no http, "" where it has none.
std::optional<std::string> listen_in(const std::string& file, const std::string& text) {
    yaml::Problems faults(file);
    const yaml::Node tree = yaml::parse(text, faults);
    if (!faults.empty()) return http_listen_in(text);
    for (const yaml::Entry& top : tree.entries) {
        if (top.key != "http") continue;
        for (const yaml::Entry& entry : top.value.entries)
            if (entry.key == "listen") return entry.value.scalar;
        return "";
    }
    return std::nullopt;
}

/// Of a file with faults: nobody is asked by a guess, as it may be somebody else.
std::variant<config::Endpoint, NoDoor> door_beside_faults(const std::string& file) {
    const auto text = config::RealFiles::read_any(path_of(file));
    if (!text && file == kDefaultConfig) return usual();  // `panelgate demo` has none
    if (!text) return no_door("cannot read " + file, kNoInput);
    const std::optional<std::string> listen = listen_in(file, *text);
    const auto door = config::parse_endpoint(listen.value_or(""));
    if (door && door->port != 0) return *door;
    return no_door(
        file + " has faults (`panelgate check` names them) and does not say where http listens",
        kBadConfig);
}

std::variant<config::Endpoint, NoDoor> door_of(const std::string& file) {
    const std::optional<config::Config> config = read_quietly(file);
    if (!config) return door_beside_faults(file);
    if (config->http && config->http->port != 0)
        return config::Endpoint{config->http->address, config->http->port};
    return no_door(file + (config->http ? " lets http listen on any free port"
                                        : " has no http, so nobody can be asked"));
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
        endpoint->address = config::reachable(endpoint->address);
    return door;
}

}  // namespace panelgate::app
