#include <iostream>
#include <variant>

#include "commands.hpp"
#include "http_door.hpp"
#include "panelgate/base/endpoint_text.hpp"
#include "readiness.hpp"

namespace panelgate::app {
namespace {

constexpr Duration kPatience = 2s;

}  // namespace

ExitCode health(const std::string& file, const std::string& http) {
    const auto door = http_door(file, http);
    if (const auto* none = std::get_if<NoDoor>(&door)) {
        std::cerr << "panelgate: " << (none->code == kUsage ? "" : "not ready: ") << none->why
                  << '\n';
        return none->code == kUsage ? kUsage : kNotReady;
    }
    const auto& [address, port] = std::get<config::Endpoint>(door);
    const std::string why = ask_whether_ready(address, port, kPatience);
    if (why.empty()) return kFine;
    std::cerr << "panelgate: not ready: http://" << endpoint_text(address, port)
              << "/readyz: " << why << '\n';
    return kNotReady;
}

}  // namespace panelgate::app
