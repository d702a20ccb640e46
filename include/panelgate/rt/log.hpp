#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

using LogField = std::pair<std::string_view, std::string>;

/// To stderr; a pipe that is full or closed loses lines, never blocks or ends the program.
void set_up_log(const LogSettings& settings);
bool log_enabled(LogLevel level);
/// One line an event: `2026-11-21T10:00:00.123Z info line up line=floor1 device=/dev/x`. Values
/// with blanks or quotes are quoted; control characters are escaped.
void log(LogLevel level, std::string_view event, std::span<const LogField> fields);
void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});

/// For tests: while it lives, lines go to it, without their time, instead of to stderr. One at a
/// time.
class LogTap {
  public:
    LogTap();
    ~LogTap();
    LogTap(const LogTap&) = delete;
    LogTap& operator=(const LogTap&) = delete;

    /// "warn cannot accept listener=127.0.0.1:502 reason=..."
    const std::vector<std::string>& lines() const { return *lines_; }
    /// How many of them hold this.
    std::size_t count(std::string_view part) const;

  private:
    std::shared_ptr<std::vector<std::string>> lines_;
};

}  // namespace panelgate::rt
