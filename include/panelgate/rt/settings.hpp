#pragma once

#include <cstdint>

namespace panelgate::rt {

/// error: a user must act. warn: it recovered, or will. info: life cycle. trace: bytes.
enum class LogLevel : std::uint8_t { error, warn, info, debug, trace };
enum class LogFormat : std::uint8_t { text, json };

struct LogSettings {
    LogLevel level = LogLevel::info;
    LogFormat format = LogFormat::text;
    friend bool operator==(const LogSettings&, const LogSettings&) = default;
};

/// Realtime options for punctual frames.
struct RealtimeSettings {
    int priority = 0;          ///< 1..99: SCHED_FIFO priority; 0: normal scheduling
    bool lock_memory = false;  ///< memory is never paged out (mlockall)
    friend bool operator==(const RealtimeSettings&, const RealtimeSettings&) = default;
};

}  // namespace panelgate::rt
