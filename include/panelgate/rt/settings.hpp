#pragma once

#include <cstdint>

namespace panelgate::rt {

/// error: someone must act. warn: it healed, or will. info: life cycle. trace: bytes.
enum class LogLevel : std::uint8_t { error, warn, info, debug, trace };
enum class LogFormat : std::uint8_t { text, json };

struct LogSettings {
    LogLevel level = LogLevel::info;
    LogFormat format = LogFormat::text;
};

}  // namespace panelgate::rt
