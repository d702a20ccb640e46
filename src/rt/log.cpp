#include "panelgate/rt/log.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>

#include "panelgate/base/network.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/log_output.hpp"
#include "panelgate/rt/log_throttle.hpp"

namespace panelgate::rt {
namespace {

/// Held by each function of the interface, for all that follows here.
std::mutex g_mutex;
LogSettings g_settings;
std::atomic<LogLevel> g_level = LogSettings{}.level;

/// The words of the configuration.
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

/// Where lines go; determined at the first line.
struct Destination {
    Destination() : Destination(stderr_is_journal()) {}
    explicit Destination(bool its_journal) : Destination(its_journal, open(its_journal)) {}
    Destination(bool its_journal, int its_socket)
        : journal(its_journal),
          native(its_socket >= 0),
          output(native ? its_socket : STDERR_FILENO) {}
    static int open(bool journal) { return journal ? connect_to_journal() : -1; }

    bool journal;
    bool native;  ///< journald's native protocol
    LogOutput output;
};

Destination& destination() {
    static Destination instance;
    return instance;
}

LogOutput& output() { return destination().output; }

/// Text for the journal has no time: the journal adds its own.
std::string pattern() {
    if (g_settings.format == LogFormat::json) return R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ",%v})";
    return destination().journal ? "%v" : "%Y-%m-%dT%H:%M:%S.%eZ %v";
}

std::string with_time(const std::string& text) {
    spdlog::pattern_formatter formatter(pattern(), spdlog::pattern_time_type::utc, "\n");
    spdlog::memory_buf_t line;
    formatter.format({"panelgate", spdlog::level::off, text}, line);
    return {line.data(), line.size()};
}

/// Returns the line as written to the output.
std::string whole(LogLevel level, const LogLine& line) {
    const std::string text = with_time(line.text);
    if (destination().native) return line.fields + "MESSAGE=" + text;
    if (!destination().journal) return text;
    return fmt::format("<{}>{}", journal_priority(level), text);
}

/// Lines of the active LogTap, if any.
std::shared_ptr<std::vector<std::string>> g_tap_lines;

/// Recent lines, for throttling.
LogThrottle g_throttle;
LogRepeats g_repeats;

/// Escapes as in a JSON string; also used for text.
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

/// What is not plain stands in quotes, and no value has a bare quote: a text of a client cannot
/// look like an event (the audit's anchors are read by position), nor move a terminal's cursor.
std::string text_value(const std::string& value) {
    const bool plain = !value.empty() && std::ranges::all_of(value, [](char c) {
        const auto u = static_cast<unsigned char>(c);
        return u > 0x20 && u != 0x7f && c != '"' && c != '\\' && c != '=';
    });
    return plain ? value : '"' + escaped(value) + '"';
}

std::string field_of(std::string_view key, const std::string& value) {
    return g_settings.format == LogFormat::json ? fmt::format(",\"{}\":\"{}\"", key, escaped(value))
                                                : fmt::format(" {}={}", key, text_value(value));
}

LogLine line_of(LogLevel level, std::string_view event, std::span<const LogField> fields) {
    LogLine line{g_settings.format == LogFormat::json
                     ? fmt::format("\"level\":\"{}\",\"event\":\"{}\"", word(level), escaped(event))
                     : fmt::format("{} {}", word(level), event)};
    for (const auto& [key, value] : fields) line.text += field_of(key, value);
    if (destination().native) line.fields = journal_fields(level, event, fields);
    return line;
}

std::string subject_of(std::span<const LogField> fields) {
    std::string subject;
    std::size_t taken = 0;
    for (const auto& [key, value] : fields) {
        if (++taken > 2) break;
        subject += key == "client" ? name_of_host(value) : value;
        subject += '\0';
    }
    return subject;
}

std::string client_of(std::span<const LogField> fields) {
    const auto client = std::ranges::find(fields, "client", &LogField::first);
    return client == fields.end() ? "" : name_of_host(client->second);
}

void append(LogLine& line, std::string_view key, const std::string& value) {
    line.text += field_of(key, value);
    if (destination().native) append_journal_field(line.fields, key, value);
}

void put(LogLevel level, LogLine line, std::uint64_t left_out) {
    if (left_out > 0) append(line, "left_out", std::to_string(left_out));
    if (g_tap_lines) return g_tap_lines->push_back(std::move(line.text));
    output().write(whole(level, line));
}

/// Writes the line, unless its subject exceeds `pace`: then the throttle keeps it.
void write_throttled_line(LogLevel level, std::string_view event, std::string_view subject,
                          std::span<const LogField> fields, const LogThrottle::Pace& pace) {
    const auto passed =
        g_throttle.pass(std::chrono::steady_clock::now(), event, subject, pace, client_of(fields));
    LogLine line = line_of(level, event, fields);
    if (passed) return put(level, std::move(line), *passed);
    g_throttle.hold(event, subject, level, std::move(line));
}

/// "256+": not all were counted.
std::string number_of_clients(std::size_t clients) {
    return std::to_string(clients) + (clients < LogThrottle::kMostClients ? "" : "+");
}

void write_throttled(TimePoint now) {
    for (LogThrottle::Held& held : g_throttle.take_kept(now))
        put(held.level, std::move(held.line), held.left_out);
    for (const LogThrottle::LeftOut& one : g_throttle.take_left_out(now)) {
        std::vector<LogField> fields{{"of", one.event}};
        if (!one.client.empty()) fields.emplace_back("client", one.client);
        if (one.clients > 0) fields.emplace_back("clients", number_of_clients(one.clients));
        fields.emplace_back("count", std::to_string(one.count));
        put(LogLevel::warn, line_of(LogLevel::warn, "log lines left out", fields), 0);
    }
}

void write_merged(std::vector<LogRepeats::Gathered> gathered) {
    for (LogRepeats::Gathered& one : gathered) {
        append(one.line, "repeated", std::to_string(one.repeated));
        append(one.line, "first", rfc3339(one.first));
        append(one.line, "last", rfc3339(one.last));
        put(LogLevel::info, std::move(one.line), 0);
    }
}

/// Of throttled lines those that are due.
void write_what_waits(TimePoint now) {
    const std::lock_guard lock(g_mutex);
    write_throttled(now);
    write_merged(g_repeats.take_due(now));
}

}  // namespace

void set_up_log(const LogSettings& settings) {
    const std::lock_guard lock(g_mutex);
    g_settings = settings;
    g_level = settings.level;
    output().on_lost([](std::uint64_t lines) {
        const LogField count{"count", std::to_string(lines)};
        return whole(LogLevel::warn, line_of(LogLevel::warn, "log lines dropped", {&count, 1}));
    });
}

bool log_enabled(LogLevel level) { return level <= g_level; }

std::uint64_t log_lines_dropped() {
    const std::lock_guard lock(g_mutex);
    return output().dropped();
}

void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
    log(level, event, std::span(fields.begin(), fields.size()));
}

void log(LogLevel level, std::string_view event, std::span<const LogField> fields) {
    if (!log_enabled(level)) return;
    const std::lock_guard lock(g_mutex);
    if (level > LogLevel::info) return put(level, line_of(level, event, fields), 0);
    write_throttled_line(level, event, subject_of(fields), fields, LogThrottle::kIncidents);
}

void log_about(std::string_view subject, LogLevel level, std::string_view event,
               std::initializer_list<LogField> fields) {
    if (!log_enabled(level)) return;
    const std::lock_guard lock(g_mutex);
    write_throttled_line(level, event, subject, std::span(fields.begin(), fields.size()),
                         LogThrottle::kIncidents);
}

void log_collapsed(std::string_view event, std::string_view subject,
                   std::span<const LogField> fields) {
    if (!log_enabled(LogLevel::info)) return;
    const std::lock_guard lock(g_mutex);
    write_throttled_line(LogLevel::info, event, subject, fields, LogThrottle::kActions);
}

void log_each(std::string_view event, std::string_view place, std::string_view what,
              std::span<const LogField> fields) {
    if (!log_enabled(LogLevel::info)) return;
    const std::lock_guard lock(g_mutex);
    const bool again = g_repeats.is_repeat(std::chrono::steady_clock::now(), place, what);
    write_merged(g_repeats.take_ended());
    LogLine line = line_of(LogLevel::info, event, fields);
    if (!again) return put(LogLevel::info, std::move(line), 0);
    g_repeats.gather(place, std::move(line), wall_now());
}

struct LogDrain::State : std::enable_shared_from_this<LogDrain::State> {
    State(Clock& its_clock, boost::asio::any_io_executor its_loop)
        : clock(its_clock),
          loop(std::move(its_loop)),
          alarm(clock.make_alarm()),
          held(clock.make_alarm()) {}

    void write_throttled_later() {
        constexpr Duration kPause = 10s;
        held->arm(clock.now() + kPause, [self = shared_from_this()] {
            write_what_waits(self->clock.now());
            self->write_throttled_later();
        });
    }

    void watch() {
        constexpr Duration kPause = 20ms;
        alarm->arm(clock.now() + kPause, [self = shared_from_this()] {
            const std::lock_guard lock(g_mutex);
            output().flush();
            if (output().pending()) self->watch();
        });
    }

    /// Lines begin to queue, in whatever thread.
    void on_pending() {
        if (!loop) return watch();
        boost::asio::post(loop, [self = shared_from_this()] { self->watch(); });
    }

    Clock& clock;
    boost::asio::any_io_executor loop;
    std::unique_ptr<Alarm> alarm;
    std::unique_ptr<Alarm> held;  ///< writes throttled lines that nothing follows
};

LogDrain::LogDrain(Clock& clock, boost::asio::any_io_executor loop)
    : state_(std::make_shared<State>(clock, std::move(loop))) {
    const std::lock_guard lock(g_mutex);
    output().on_pending([state = state_.get()] { state->on_pending(); });
    if (output().pending()) state_->watch();
    state_->write_throttled_later();
}

LogDrain::~LogDrain() {
    state_->alarm->cancel();
    state_->held->cancel();
    write_what_waits(TimePoint::max());
    const std::lock_guard lock(g_mutex);
    output().on_pending({});
    output().flush();
}

LogTap::LogTap() : lines_(std::make_shared<std::vector<std::string>>()) {
    const std::lock_guard lock(g_mutex);
    g_tap_lines = lines_;
    g_throttle = {};
    g_repeats = {};
}

LogTap::~LogTap() {
    const std::lock_guard lock(g_mutex);
    g_tap_lines.reset();
}

std::size_t LogTap::count(std::string_view part) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        *lines_, [&](const std::string& line) { return line.find(part) != std::string::npos; }));
}

}  // namespace panelgate::rt
