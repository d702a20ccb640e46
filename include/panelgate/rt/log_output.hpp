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

/// Where log lines go: a descriptor whose reader may be slow, stopped or gone. Nothing here waits
/// for it: what it does not take is kept, up to a limit, and what does not fit is dropped and
/// counted. One thread.
class LogOutput {
  public:
    static constexpr std::size_t kMostPending = 256 * 1024;  ///< bytes

    /// The descriptor stays the caller's, and its flags stay as they are: other processes share
    /// them.
    explicit LogOutput(int descriptor, std::size_t most_pending = kMostPending);
    ~LogOutput();
    LogOutput(const LogOutput&) = delete;
    LogOutput& operator=(const LogOutput&) = delete;

    /// One line with its end. Lines stay whole and in order.
    void write(std::string_view line);
    /// Hands over what the reader takes now. Told once how many lines were lost meanwhile, as soon
    /// as there is room again.
    void flush();
    bool pending() const { return !pending_.empty(); }
    /// Lines that nobody will see.
    std::uint64_t dropped() const { return dropped_; }
    /// Makes the line that tells of so many lost ones; without it nothing tells.
    void on_lost(std::function<std::string(std::uint64_t)> line) { lost_line_ = std::move(line); }
    /// Called when lines begin to wait: somebody is to flush() now and then.
    void on_pending(std::function<void()> called) { on_pending_ = std::move(called); }

  private:
    enum class Kind : std::uint8_t { own, file, socket, shared, terminal };

    std::optional<std::size_t> hand_over(std::string_view bytes);
    void keep(std::string line);
    void drop();

    int descriptor_;
    int own_ = -1;  ///< the same file, opened anew so that it never blocks; -1: not possible
    Kind kind_ = Kind::shared;
    std::size_t most_;
    std::deque<std::string> pending_;  ///< the first one may be the rest of a line
    std::size_t bytes_ = 0;
    bool begun_ = false;  ///< the first one is
    bool cut_ = false;    ///< the last line that was written has no end
    std::uint64_t dropped_ = 0;
    std::uint64_t untold_ = 0;
    std::function<std::string(std::uint64_t)> lost_line_;
    std::function<void()> on_pending_;
};

/// Of syslog(3): 3 error, 4 warning, 6 informational, 7 debug.
int journal_priority(LogLevel level);

/// Whether JOURNAL_STREAM ("DEVICE:INODE", systemd.exec(5)) means this file.
bool is_journal_stream(std::string_view stream, dev_t device, ino_t inode);
/// Whether systemd has connected stderr to the journal.
bool stderr_is_journal();
/// A datagram socket to journald, the caller's; -1 where there is none.
int connect_to_journal();

/// Fields as journald's native protocol wants them
/// (https://systemd.io/JOURNAL_NATIVE_PROTOCOL/): PRIORITY, SYSLOG_IDENTIFIER, PANELGATE_EVENT, and
/// of a field `line` PANELGATE_LINE. One datagram is these, then "MESSAGE=", the text and '\n'.
std::string journal_fields(LogLevel level, std::string_view event,
                           std::span<const LogField> fields);
/// One more of them.
void append_journal_field(std::string& fields, std::string_view key, std::string_view value);

}  // namespace panelgate::rt
