#include "panelgate/rt/log.hpp"

#include <fmt/format.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>

#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/log_output.hpp"
#include "panelgate/rt/log_throttle.hpp"

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
    std::abort();
}

/// As the configuration calls them.
std::string_view word(LogLevel level) {
    switch (level) {
        case LogLevel::error:
            return "error";
        case LogLevel::warn:
            return "warn";
        case LogLevel::info:
            return "info";
        case LogLevel::debug:
            return "debug";
        case LogLevel::trace:
            return "trace";
    }
    std::abort();
}

LogOutput& output() {
    static LogOutput instance(STDERR_FILENO);
    return instance;
}

class Sink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
  public:
    std::string formatted(const spdlog::details::log_msg& message) {
        spdlog::memory_buf_t line;
        formatter_->format(message, line);
        return {line.data(), line.size()};
    }

  private:
    void sink_it_(const spdlog::details::log_msg& message) override {
        output().write(formatted(message));
    }
    void flush_() override {}
};

const std::shared_ptr<Sink>& sink() {
    static const auto instance = std::make_shared<Sink>();
    return instance;
}

spdlog::logger& logger() {
    static spdlog::logger instance("panelgate", sink());
    return instance;
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

std::string field_of(std::string_view key, const std::string& value) {
    return g_format == LogFormat::json ? fmt::format(",\"{}\":\"{}\"", key, escaped(value))
                                       : fmt::format(" {}={}", key, text_value(value));
}

std::string line_of(LogLevel level, std::string_view event, LogFields fields) {
    std::string line =
        g_format == LogFormat::json
            ? fmt::format("\"level\":\"{}\",\"event\":\"{}\"", word(level), escaped(event))
            : fmt::format("{} {}", word(level), event);
    for (const auto& [key, value] : fields) line += field_of(key, value);
    return line;
}

std::string subject_of(LogFields fields) {
    std::string subject;
    std::size_t taken = 0;
    for (const auto& [key, value] : fields) {
        if (++taken > 2) break;
        // A client's next connection has another port.
        subject += key == "client" ? value.substr(0, value.rfind(':')) : value;
        subject += '\0';
    }
    return subject;
}

}  // namespace

void set_up_log(const LogSettings& settings) {
    g_format = settings.format;
    logger().set_level(level_of(settings.level));
    const bool json = settings.format == LogFormat::json;
    logger().set_formatter(std::make_unique<spdlog::pattern_formatter>(
        json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ",%v})" : "%Y-%m-%dT%H:%M:%S.%eZ %v",
        spdlog::pattern_time_type::utc, "\n"));
    output().on_lost([](std::uint64_t lines) {
        const std::string text =
            line_of(LogLevel::warn, "log lines dropped", {{"count", std::to_string(lines)}});
        return sink()->formatted({"panelgate", spdlog::level::warn, text});
    });
}

bool log_enabled(LogLevel level) { return logger().should_log(level_of(level)); }

std::uint64_t log_lines_dropped() { return output().dropped(); }

void log(LogLevel level, std::string_view event, LogFields fields) {
    if (!log_enabled(level)) return;
    static LogThrottle throttle;
    std::uint64_t left_out = 0;
    if (level <= LogLevel::info) {
        const auto passed = throttle.pass(now(), event, subject_of(fields));
        if (!passed) return;
        left_out = *passed;
    }
    std::string line = line_of(level, event, fields);
    if (left_out > 0) line += field_of("left_out", std::to_string(left_out));
    logger().log(level_of(level), line);
}

struct LogDrain::State : std::enable_shared_from_this<LogDrain::State> {
    explicit State(Clock& its_clock) : clock(its_clock), alarm(clock.make_alarm()) {}

    void watch() {
        constexpr Duration kPause = 20ms;
        if (!output().pending()) return;
        alarm->arm(clock.now() + kPause, [self = shared_from_this()] {
            output().flush();
            self->watch();
        });
    }

    Clock& clock;
    std::unique_ptr<Alarm> alarm;
};

LogDrain::LogDrain(Clock& clock) : state_(std::make_shared<State>(clock)) {
    output().on_pending([state = state_.get()] { state->watch(); });
    state_->watch();
}

LogDrain::~LogDrain() {
    output().on_pending({});
    state_->alarm->cancel();
    output().flush();
}

}  // namespace panelgate::rt
