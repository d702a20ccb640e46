#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "commands.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/tls/stream.hpp"
#include "panelgate/web/http/client.hpp"

namespace panelgate::commands {

/// The value of `listen:` of the top-level `http:` in a text that is not valid YAML, such as a file
/// being edited; "" without `listen`, or with two different ones. Pure.
std::string http_listen_in(std::string_view text);

/// Why it is unknown where a gateway is asked.
struct NoHttpDoor {
    std::string why;
    ExitCode code;  ///< kUsage: wrong command line; else kNoInput, kBadConfig, kNotReady
};
/// Where a gateway is asked, and by whose certificate it is known.
struct HttpDoor {
    config::Endpoint endpoint;        ///< with an address that can be connected to, or a name
    std::optional<tls::Trust> trust;  ///< nothing: it is asked by plain HTTP
    bool is_local = false;            ///< the file says so: on loopback

    std::string url() const;  ///< "https://127.0.0.1:8443"
};
/// The door that `options.http` names (HOST:PORT, also with http:// or https://), or, if that is
/// "", the one in the file, even if the file has faults. Whom to trust is what the file says, and
/// `options.ca`. If the default file does not exist, the default door, which `panelgate demo` has.
std::variant<HttpDoor, NoHttpDoor> http_door(const GatewayOptions& options);

using web::first_line;
using web::HttpReply;

/// As web::ask().
HttpReply ask(const HttpDoor& door, const std::string& request, Duration patience, std::size_t most,
              const std::function<bool(const HttpReply&)>& enough);

/// Requests /readyz and waits for at most `patience`. A local gateway is believed whatever its
/// certificate: where a new one is kept back, it is ready with the former one, and the question
/// holds no secret. Empty if the answer is 200; else the answer
/// or the error in one printable line.
/// `active`: a box that waits for another box to go is not ready.
std::string ask_whether_ready(const HttpDoor& door, Duration patience, bool active);

}  // namespace panelgate::commands
