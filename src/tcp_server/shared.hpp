#pragma once

#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::tcp_server {

/// What the connections of one listener share; held by the listener and by each of them.
struct Shared {
    Settings settings;
    UnitMap units;
    Hooks hooks;
    rt::Clock& clock;
    Counters counters;
    TimePoint started;

    void log(std::string_view event, std::string_view client, std::string_view more = {}) const;
};

}  // namespace panelgate::tcp_server
