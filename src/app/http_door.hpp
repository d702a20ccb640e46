#pragma once

#include <string>
#include <variant>

#include "exit_code.hpp"
#include "panelgate/config/endpoint.hpp"

namespace panelgate::app {

/// Why nobody can know where a gateway listens.
struct NoDoor {
    std::string why;
    ExitCode code;  ///< kUsage: of the command line; kNoInput, kBadConfig, kNotReady
};
/// Where the gateway's HTTP listens, its address one that can be connected to: `http` (ADDR:PORT),
/// or, when that is "", what the file says, faults or not. Without the usual file the default: what
/// runs without one listens there.
std::variant<config::Endpoint, NoDoor> http_door(const std::string& file, const std::string& http);

}  // namespace panelgate::app
