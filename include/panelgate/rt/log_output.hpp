#pragma once

#include <sys/types.h>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panelgate/rt/log_throttle.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

/// Writes log lines to a descriptor whose reader may be slow, stopped or gone, without ever
/// blocking: what it does not take is queued up to a limit, the rest is dropped and counted.
/// Single-threaded.
class LogOutput {
  public:
    static constexpr std::size_t kMostPending = 256 * 1024;  ///< bytes

    /// The caller keeps the descriptor, and its flags stay unchanged: other processes share them.
    explicit LogOutput(int descriptor, std::size_t most_pending = kMostPending);
    ~LogOutput();
    LogOutput(const LogOutput&) = delete;
    LogOutput& operator=(const LogOutput&) = delete;

    /// Writes one line, including its newline. Lines stay whole and in order.
    void write(std::string_view line);
    /// Writes what the reader takes now. Reports once how many lines were lost, as soon as there is
    /// room again.
    void flush();
    bool pending() const { return !pending_.empty(); }
    /// Returns the number of dropped lines.
    std::uint64_t dropped() const { return dropped_; }
    /// Sets the function that formats the report of lost lines; without it there is no report.
    void on_lost(std::function<std::string(std::uint64_t)> line) { lost_line_ = std::move(line); }
    /// Called when lines begin to queue: the caller then has to flush() from time to time.
    void on_pending(std::function<void()> called) { on_pending_ = std::move(called); }

  private:
    enum class Kind : std::uint8_t { own, file, socket, shared, terminal };

    std::optional<std::size_t> hand_over(std::string_view bytes);
    void keep(std::string line);
    void drop();

    int descriptor_;
    int own_ = -1;  ///< the same file reopened with O_NONBLOCK; -1: not possible
    Kind kind_ = Kind::shared;
    std::size_t most_;
    std::deque<std::string> pending_;  ///< the first may be the rest of a line
    std::size_t bytes_ = 0;
    bool begun_ = false;  ///< the first is partly written
    bool cut_ = false;    ///< the last written line has no newline
    std::uint64_t dropped_ = 0;
    std::uint64_t unreported_ = 0;
    std::function<std::string(std::uint64_t)> lost_line_;
    std::function<void()> on_pending_;
};

/// Returns the syslog(3) priority: 3 error, 4 warning, 6 informational, 7 debug.
int journal_priority(LogLevel level);

/// True if JOURNAL_STREAM ("DEVICE:INODE", systemd.exec(5)) names this file.
bool is_journal_stream(std::string_view stream, dev_t device, ino_t inode);
/// True if systemd has connected stderr to the journal.
bool stderr_is_journal();
/// Returns a datagram socket to journald, owned by the caller; -1 if there is none.
int connect_to_journal();

/// Formats fields for journald's native protocol (https://systemd.io/JOURNAL_NATIVE_PROTOCOL/):
/// PRIORITY, SYSLOG_IDENTIFIER, PANELGATE_EVENT, and PANELGATE_LINE for a field `line`. A datagram
/// is these, then "MESSAGE=", the text and '\n'.
std::string journal_fields(LogLevel level, std::string_view event,
                           std::span<const LogField> fields);
/// Appends one more field.
void append_journal_field(std::string& fields, std::string_view key, std::string_view value);

}  // namespace panelgate::rt
