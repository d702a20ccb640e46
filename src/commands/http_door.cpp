#include "http_door.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "commands.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace {

/// Returns the value of `listen:` in a line of the section `http`, without quotes.
std::optional<std::string> listen_in(std::string_view line) {
    constexpr std::string_view kListen = "listen:";
    const std::size_t at = line.find(kListen);
    const bool is_key =
        at != line.npos && at > 0 && std::string_view(" \t{,").find(line[at - 1]) != line.npos;
    if (!is_key) return std::nullopt;
    line.remove_prefix(at + kListen.size());
    line.remove_prefix(std::min(line.find_first_not_of(" \t\"'"), line.size()));
    return std::string(line.substr(0, line.find_first_of(" \t\"',}#")));
}

}  // namespace

std::string http_listen_in(std::string_view text) {
    text.remove_prefix(byte_order_mark(text));
    std::set<std::string> found;
    bool is_inside = false;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::size_t first = line.find_first_not_of(" \t\r\n");
        if (first == line.npos || line[first] == '#') continue;
        if (first == 0) is_inside = line.starts_with("http:");
        const auto listen = is_inside ? listen_in(line) : std::nullopt;
        if (listen) found.insert(*listen);
    }
    return found.size() == 1 ? *found.begin() : "";
}

namespace {

config::Endpoint usual() {
    const web::Settings settings;
    return {settings.address, settings.port};
}

/// What a file says of `http`.
struct Known {
    std::optional<config::Endpoint> endpoint;
    NoHttpDoor why{};  ///< there is none
    std::optional<tls::Trust> trust{};
};

Known nowhere(const std::string& why, ExitCode code = kNotReady) {
    return {std::nullopt, {why + "; --http HOST:PORT says where", code}};
}

/// Where `http` has `tls`, nothing is asked in plain.
std::optional<tls::Trust> trust_in(const std::string& file, const yaml::Node* http) {
    const yaml::Node* secure = http == nullptr ? nullptr : http->find("tls");
    if (secure == nullptr) return std::nullopt;
    const auto content = [&](std::string_view key) {
        const yaml::Node* path = secure->find(key);
        if (path == nullptr) return std::string();
        return config::RealFiles::read_any(config::beside(explain::path_of(file), path->scalar))
            .value_or("");
    };
    return tls::Trust{content("certificate"), content("ca")};
}

/// From a file with faults, such as a key that only the gateway may read. No endpoint is guessed:
/// it might be another program's.
Known known_despite_faults(const std::string& file) {
    const auto text = config::RealFiles::read_any(explain::path_of(file));
    if (!text && file == kDefaultConfig) return {usual()};  // `panelgate demo` has none
    if (!text) return nowhere("cannot read " + file, kNoInput);
    yaml::Problems faults(file);
    const yaml::Node tree = yaml::parse(*text, faults);
    std::string listen = http_listen_in(*text);
    std::optional<tls::Trust> trust;
    if (faults.empty()) {
        const yaml::Node* http = tree.find("http");
        const yaml::Node* at = http == nullptr ? nullptr : http->find("listen");
        listen = at == nullptr ? "" : at->scalar;
        trust = trust_in(file, http);
    } else if (text->find("tls:") != std::string::npos) {
        trust.emplace();
    }
    Known known = nowhere(
        file + " has faults (`panelgate check` names them) and does not say where http listens",
        kBadConfig);
    const auto found = config::parse_endpoint(listen);
    if (found && found->port != 0) known.endpoint = *found;
    known.trust = std::move(trust);
    return known;
}

Known known_by(const std::string& file) {
    const std::optional<config::Config> config = explain::read_quietly(file);
    if (!config) return known_despite_faults(file);
    if (!config->http) return nowhere(file + " has no http, so the gateway cannot be asked");
    Known known = nowhere(file + " lets http listen on any free port");
    if (config->http->port != 0)
        known.endpoint = config::Endpoint{config->http->address, config->http->port};
    if (config->http->tls) {
        const tls::Material& files = config->http->tls->material;
        known.trust = tls::Trust{files.certificate, files.ca};
    }
    return known;
}

constexpr std::string_view kPlainScheme = "http://";
constexpr std::string_view kSecureScheme = "https://";

/// HOST:PORT of http://HOST:PORT/, as it is copied from a browser.
std::string without_scheme(std::string http) {
    for (const std::string_view scheme : {kPlainScheme, kSecureScheme})
        if (http.starts_with(scheme)) http.erase(0, scheme.size());
    if (http.ends_with('/')) http.pop_back();
    return http;
}

/// An address, or a name that is looked up when it is asked.
std::optional<config::Endpoint> door_typed(const std::string& http) {
    const std::string typed = without_scheme(http);
    auto found = config::parse_endpoint(typed);
    const auto named = line::parse_tcp_device("tcp://" + typed);
    if (!found && named)
        found = {named->host, static_cast<std::uint16_t>(*yaml::parse_integer(named->port))};
    return found && found->port != 0 ? found : std::nullopt;
}

}  // namespace

std::string HttpDoor::url() const {
    return std::string(trust ? kSecureScheme : kPlainScheme) +
           endpoint_text(endpoint.address, endpoint.port);
}

std::variant<HttpDoor, NoHttpDoor> http_door(const GatewayOptions& options) {
    const std::string& http = options.http;
    Known known = known_by(options.file);
    if (!http.empty()) {
        known.endpoint = door_typed(http);
        if (!known.endpoint)
            return NoHttpDoor{
                "--http '" + http +
                    "' is not HOST:PORT, such as 127.0.0.1:8080 or gateway.plant:8080",
                kUsage};
    }
    if (!known.endpoint) return known.why;
    HttpDoor door{{config::reachable(known.endpoint->address), known.endpoint->port}, known.trust};
    if (http.starts_with(kPlainScheme)) {
        door.trust.reset();
    } else if (!door.trust && (http.starts_with(kSecureScheme) || !options.ca.empty())) {
        door.trust.emplace();
    }
    if (door.trust && http.empty() && config::is_loopback(door.endpoint.address)) {
        // It may still have a former certificate, of other names.
        door.trust->any_name = true;
        door.is_local = true;
    }
    if (options.ca.empty()) return door;
    const auto ca = config::RealFiles::read_any(options.ca);
    if (!ca || !door.trust)
        return NoHttpDoor{ca ? "--ca is for https://" : "cannot read --ca " + options.ca,
                          ca ? kUsage : kNoInput};
    door.trust->ca += *ca;
    return door;
}

HttpReply ask(const HttpDoor& door, const std::string& request, Duration patience, std::size_t most,
              const std::function<bool(const HttpReply&)>& enough) {
    return web::ask({door.endpoint.address, door.endpoint.port, door.trust}, request, patience,
                    most, enough);
}

namespace {

constexpr std::size_t kMost = 4096;  // maximum bytes of the answer

bool is_ready(const HttpReply& reply) {
    const bool whole = reply.text.find("\r\n") != std::string::npos;
    return whole && reply.is_http() && (reply.status() + ' ').starts_with("200 ");
}

}  // namespace

std::string ask_whether_ready(const HttpDoor& door, Duration patience, bool active) {
    const std::string request =
        std::string("GET /readyz") + (active ? "?active=true" : "") +
        " HTTP/1.1\r\nHost: " + endpoint_text(door.endpoint.address, door.endpoint.port) +
        "\r\nConnection: close\r\n\r\n";
    HttpDoor asked = door;
    if (asked.trust && asked.is_local) asked.trust->anybody = true;
    const HttpReply reply = ask(asked, request, patience, kMost, is_ready);
    if (is_ready(reply)) return {};
    if (reply.text.empty()) return reply.failure();
    if (!reply.is_http()) return "an answer that is no HTTP: " + first_line(reply.text);
    const std::string why = first_line(reply.body());
    return reply.status() + (why.empty() ? "" : ": " + why);
}

}  // namespace panelgate::commands
