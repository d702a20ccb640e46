#include "panelgate/rt/log.hpp"

#include <fmt/format.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
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

/// Of the LogTap that lives.
std::shared_ptr<std::vector<std::string>> g_tapped;

/// Who has said what lately.
LogThrottle g_throttle;

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

std::string line_of(LogLevel level, std::string_view event, std::span<const LogField> fields) {
    std::string line =
        g_format == LogFormat::json
            ? fmt::format("\"level\":\"{}\",\"event\":\"{}\"", word(level), escaped(event))
            : fmt::format("{} {}", word(level), event);
    for (const auto& [key, value] : fields) line += field_of(key, value);
    return line;
}

std::string subject_of(std::span<const LogField> fields) {
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

void put(LogLevel level, std::string line, std::uint64_t left_out) {
    if (left_out > 0) line += field_of("left_out", std::to_string(left_out));
    if (g_tapped) return g_tapped->push_back(std::move(line));
    logger().log(level_of(level), line);
}

/// From error to info: unless its subject has said the same too often.
void put_at_pace(LogLevel level, std::string_view event, std::string_view subject,
                 std::span<const LogField> fields, const LogThrottle::Pace& pace) {
    const auto passed = g_throttle.pass(std::chrono::steady_clock::now(), event, subject, pace);
    std::string line = line_of(level, event, fields);
    if (passed) return put(level, std::move(line), *passed);
    g_throttle.hold(event, subject, level, std::move(line));
}

void put_held(TimePoint now) {
    for (LogThrottle::Held& held : g_throttle.take_held(now))
        put(held.level, std::move(held.line), held.left_out);
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
        const std::string text = line_of(LogLevel::warn, "log lines dropped",
                                         {{LogField{"count", std::to_string(lines)}}});
        return sink()->formatted({"panelgate", spdlog::level::warn, text});
    });
}

bool log_enabled(LogLevel level) { return logger().should_log(level_of(level)); }

std::uint64_t log_lines_dropped() { return output().dropped(); }

void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
    log(level, event, std::span(fields.begin(), fields.size()));
}

void log(LogLevel level, std::string_view event, std::span<const LogField> fields) {
    if (!log_enabled(level)) return;
    if (level > LogLevel::info) return put(level, line_of(level, event, fields), 0);
    put_at_pace(level, event, subject_of(fields), fields, LogThrottle::kIncidents);
}

void log_about(std::string_view subject, LogLevel level, std::string_view event,
               std::initializer_list<LogField> fields) {
    if (!log_enabled(level)) return;
    put_at_pace(level, event, subject, std::span(fields.begin(), fields.size()),
                LogThrottle::kIncidents);
}

void log_deed(std::string_view event, std::string_view subject,
              std::initializer_list<LogField> fields) {
    if (!log_enabled(LogLevel::info)) return;
    put_at_pace(LogLevel::info, event, subject, std::span(fields.begin(), fields.size()),
                LogThrottle::kDeeds);
}

struct LogDrain::State : std::enable_shared_from_this<LogDrain::State> {
    explicit State(Clock& its_clock)
        : clock(its_clock), alarm(clock.make_alarm()), held(clock.make_alarm()) {}

    void tell_held() {
        constexpr Duration kPause = 10s;
        held->arm(clock.now() + kPause, [self = shared_from_this()] {
            put_held(self->clock.now());
            self->tell_held();
        });
    }

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
    std::unique_ptr<Alarm> held;  ///< for what was left out and nothing follows
};

LogDrain::LogDrain(Clock& clock) : state_(std::make_shared<State>(clock)) {
    output().on_pending([state = state_.get()] { state->watch(); });
    state_->watch();
    state_->tell_held();
}

LogDrain::~LogDrain() {
    output().on_pending({});
    state_->alarm->cancel();
    state_->held->cancel();
    put_held(TimePoint::max());
    output().flush();
}

LogTap::LogTap() : lines_(std::make_shared<std::vector<std::string>>()) {
    g_tapped = lines_;
    g_throttle = {};
}

LogTap::~LogTap() { g_tapped.reset(); }

std::size_t LogTap::count(std::string_view part) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        *lines_, [&](const std::string& line) { return line.find(part) != std::string::npos; }));
}

}  // namespace panelgate::rt
