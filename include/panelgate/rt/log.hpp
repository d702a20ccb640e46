#pragma once

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

/// To stderr, whose reader may be slow, stopped or gone: nobody waits for it. Lines that it does
/// not take wait (LogOutput); then they are lost and counted. Where stderr is systemd's journal,
/// journald is told each line with its priority and fields (journal.hpp), or by <N> before it.
void set_up_log(const LogSettings& settings);
bool log_enabled(LogLevel level);
/// Lines that nobody will see, because stderr's reader stood still.
std::uint64_t log_lines_dropped();

/// Hands over what waits, now and then, for as long as it lives; in the end what was left out last.
class LogDrain {
  public:
    explicit LogDrain(Clock& clock);
    ~LogDrain();

  private:
    struct State;
    std::shared_ptr<State> state_;
};

/// One line an event: `2026-11-21T10:00:00.123Z info line up line=floor1 device=/dev/x`. Values
/// with blanks or quotes are quoted; control characters are escaped. The first two fields say whom
/// it is about: from error to info, the same event of the same subject is soon left out
/// (LogThrottle), and what follows tells how often in the field `left_out`. A field `client` has a
/// budget besides, whatever the subjects; its port does not count.
void log(LogLevel level, std::string_view event, std::span<const LogField> fields);
void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});
/// The same of a subject by name: however its fields differ, its lines are of one kind.
void log_about(std::string_view subject, LogLevel level, std::string_view event,
               std::initializer_list<LogField> fields);
/// The same at info for what is to stand in the log nearly each time it happens: of one subject 30
/// times at once, then once a minute; the last one always.
void log_deed(std::string_view event, std::string_view subject, std::span<const LogField> fields);
/// The same for what must be in the log every time (LogRepeats): a line each, but where the last
/// one at this place was `what` too, one line tells how often, with its first and its last time.
void log_each(std::string_view event, std::string_view place, std::string_view what,
              std::span<const LogField> fields);

/// For tests: while it lives, lines go to it, without their time, instead of to stderr, and nothing
/// that was said before makes it leave one out. One at a time.
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
