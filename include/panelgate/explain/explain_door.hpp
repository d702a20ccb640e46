#pragma once

#include <optional>
#include <string>

#include "panelgate/access/settings.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// Returns the face of the listener's clients; nullopt if the configuration has no listener of the
/// name.
std::optional<Face> face_by(const config::Config& config, const std::string& listener);
/// The names of all listeners, for a message.
std::string listener_names(const config::Config& config);
/// True if it is one address, of IPv4 or IPv6.
bool is_address(const std::string& text);

/// A request at a door.
struct AtDoor {
    const Who& who;
    access::Act act = access::Act::read;
    bool writes = false;
    const config::Line& line;
    const config::Station& station;
};
/// Returns the listener's reason to refuse the request before rights are judged; "" without a
/// refusal. `now`: UTC, for the end of tokens.
std::string refused_at_door(const config::Config& config, const AtDoor& request, WallTime now);

}  // namespace panelgate::explain
