#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <string_view>

#include "panelgate/rt/log_line.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

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
