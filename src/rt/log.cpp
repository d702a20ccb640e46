#include "panelgate/rt/log.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>

namespace panelgate::rt {
namespace {

LogFormat g_format = LogFormat::text;

spdlog::level::level_enum level_of(LogLevel level) {
    switch (level) {
        case LogLevel::error:
            return spdlog::level::err;
        case LogLevel::warn:
            return spdlog::level::warn;
        case LogLevel::info:
            return spdlog::level::info;
        case LogLevel::debug:
            return spdlog::level::debug;
        case LogLevel::trace:
            return spdlog::level::trace;
    }
    return spdlog::level::err;
}

spdlog::logger& logger() {
    static const std::shared_ptr<spdlog::logger> instance = [] {
        auto sink = std::make_shared<spdlog::sinks::stderr_sink_st>();
        auto made = std::make_shared<spdlog::logger>("panelgate", std::move(sink));
        made->flush_on(spdlog::level::trace);
        return made;
    }();
    return *instance;
}

/// Of the LogTap that lives.
std::shared_ptr<std::vector<std::string>> g_tapped;

std::string_view label(LogLevel level) {
    const spdlog::string_view_t word = spdlog::level::to_string_view(level_of(level));
    return {word.data(), word.size()};
}

/// JSON string escapes; good for text too.
std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        const auto u = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (u < 0x20 || u == 0x7f) {
            out += fmt::format("\\u{:04x}", u);
        } else {
            out += c;
        }
    }
    return out;
}

std::string text_value(const std::string& value) {
    const bool plain = !value.empty() && value.find_first_of(" \"\\=\n\t\r") == std::string::npos;
    return plain ? value : '"' + escaped(value) + '"';
}

}  // namespace

void set_up_log(const LogSettings& settings) {
    g_format = settings.format;
    logger().set_level(level_of(settings.level));
    const bool json = settings.format == LogFormat::json;
    logger().set_formatter(std::make_unique<spdlog::pattern_formatter>(
        json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})"
             : "%Y-%m-%dT%H:%M:%S.%eZ %l %v",
        spdlog::pattern_time_type::utc));
}

bool log_enabled(LogLevel level) { return logger().should_log(level_of(level)); }

void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
    log(level, event, std::span(fields.begin(), fields.size()));
}

void log(LogLevel level, std::string_view event, std::span<const LogField> fields) {
    if (!log_enabled(level)) return;
    std::string line;
    if (g_format == LogFormat::json) {
        line = fmt::format("\"event\":\"{}\"", escaped(event));
        for (const auto& [key, value] : fields)
            line += fmt::format(",\"{}\":\"{}\"", key, escaped(value));
    } else {
        line = std::string(event);
        for (const auto& [key, value] : fields)
            line += fmt::format(" {}={}", key, text_value(value));
    }
    if (g_tapped) return g_tapped->push_back(fmt::format("{} {}", label(level), line));
    logger().log(level_of(level), line);
}

LogTap::LogTap() : lines_(std::make_shared<std::vector<std::string>>()) { g_tapped = lines_; }

LogTap::~LogTap() { g_tapped.reset(); }

std::size_t LogTap::count(std::string_view part) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        *lines_, [&](const std::string& line) { return line.find(part) != std::string::npos; }));
}

}  // namespace panelgate::rt
