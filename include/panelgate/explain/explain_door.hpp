#pragma once

#include <optional>
#include <string>
#include <vector>

#include "panelgate/access/settings.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::explain {

/// The face of who comes by this listener; nullopt: the configuration has none of this name.
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
/// What refuses it there, before rights are judged; "" if nothing does. `now`: a token may have
/// ended.
std::string refused_at_door(const config::Config& config, const AtDoor& request, WallTime now);

}  // namespace panelgate::explain
