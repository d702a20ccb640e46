#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/rt/log_throttle.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

class Clock;

// Any thread may log.

/// Logs to stderr without ever blocking: lines that its reader does not take are queued
/// (LogOutput), beyond a limit dropped and counted. If stderr is systemd's journal, journald gets
/// each line with its priority and fields (log_output.hpp), or with <N> before it.
void set_up_log(const LogSettings& settings);
bool log_enabled(LogLevel level);
/// Returns the number of lines dropped because stderr was not read.
std::uint64_t log_lines_dropped();

/// Flushes queued and throttled lines periodically while it lives, and at its end.
class LogDrain {
  public:
    /// `loop`: the clock's; empty: all lines are logged from that loop.
    explicit LogDrain(Clock& clock, boost::asio::any_io_executor loop = {});
    ~LogDrain();

  private:
    struct State;
    std::shared_ptr<State> state_;
};

/// Logs one line: `2026-11-21T10:00:00.123Z info line up line=floor1 device=/dev/x`. Values with
/// blanks or quotes are quoted; control characters are escaped. The first two fields name the
/// subject: from error to info, repeats of an event of one subject are throttled (LogThrottle), and
/// the next line gives their number in the field `left_out`. A field `client`, without its port,
/// has a budget besides, across all subjects, and all clients together have one for each event.
void log(LogLevel level, std::string_view event, std::span<const LogField> fields);
void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});
/// Like log(), but throttled by an explicit subject, however the fields differ.
void log_about(std::string_view subject, LogLevel level, std::string_view event,
               std::initializer_list<LogField> fields);
/// Logs at info what should be in the log nearly every time: 30 lines of one subject at once, then
/// one a minute; the last one always.
void log_collapsed(std::string_view event, std::string_view subject,
                   std::span<const LogField> fields);
/// Logs at info what must be in the log every time (LogRepeats): a line each, except that
/// consecutive lines at `place` with the same `what` become one line with their number, first and
/// last time.
void log_each(std::string_view event, std::string_view place, std::string_view what,
              std::span<const LogField> fields);

/// For tests: while it lives, captures lines, without their time, instead of writing to stderr.
/// Throttling starts afresh. One at a time.
class LogTap {
  public:
    LogTap();
    ~LogTap();
    LogTap(const LogTap&) = delete;
    LogTap& operator=(const LogTap&) = delete;

    /// "warn cannot accept listener=127.0.0.1:502 reason=..."
    const std::vector<std::string>& lines() const { return *lines_; }
    /// Number of lines that contain `part`.
    std::size_t count(std::string_view part) const;

  private:
    std::shared_ptr<std::vector<std::string>> lines_;
};

}  // namespace panelgate::rt
