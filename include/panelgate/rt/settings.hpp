#pragma once

#include <cstdint>

namespace panelgate::rt {

/// error: someone must act. warn: it healed, or will. info: life cycle. trace: bytes.
enum class LogLevel : std::uint8_t { error, warn, info, debug, trace };
enum class LogFormat : std::uint8_t { text, json };

struct LogSettings {
    LogLevel level = LogLevel::info;
    LogFormat format = LogFormat::text;
    friend bool operator==(const LogSettings&, const LogSettings&) = default;
};

/// What the machine is asked to do for punctual frames.
struct RealtimeSettings {
    int priority = 0;          ///< 1..99: first in, first out (SCHED_FIFO); 0: as all programs
    bool lock_memory = false;  ///< nothing is ever read back from a disk (mlockall)
    friend bool operator==(const RealtimeSettings&, const RealtimeSettings&) = default;
};

}  // namespace panelgate::rt
