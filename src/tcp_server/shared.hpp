#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "own_answers.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::tcp_server {

/// What the connections of one listener share; held by the listener and by each of them.
struct Shared {
    Settings settings;
    UnitMap units;
    std::string version;  ///< of the program, for the device identification
    rt::Clock& clock;
    Counters counters;
    TimePoint started;
    std::shared_ptr<OwnAnswers> own_answers;  ///< never null

    /// One line of this listener.
    void log(rt::LogLevel level, std::string_view event, std::vector<rt::LogField> more = {}) const;
};

}  // namespace panelgate::tcp_server
