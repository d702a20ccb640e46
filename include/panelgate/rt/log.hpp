#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

using LogFields = std::initializer_list<std::pair<std::string_view, std::string>>;

/// To stderr; a pipe that is full or closed loses lines, never blocks or ends the program.
void set_up_log(const LogSettings& settings);
bool log_enabled(LogLevel level);
/// One line an event: `2026-11-21T10:00:00.123Z info line up line=floor1 device=/dev/x`. Values
/// with blanks or quotes are quoted; control characters are escaped.
void log(LogLevel level, std::string_view event, LogFields fields = {});

}  // namespace panelgate::rt
