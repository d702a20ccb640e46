#include "held.hpp"

#include <array>

#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {

void Holder::tell(std::string_view key, Duration value) {
    add(key, yaml::format_duration(value), "");
}

void Holder::tell_secret(std::string_view key, std::string value) {
    held_->push_back({at(key), std::move(value), true, ""});
}

Holder Holder::item(std::string_view key) const {
    held_->push_back({at(key), "", false, ""});
    return below(key);
}

std::string Distinct::name(const std::string& known_by) {
    const int count = ++seen_[known_by];
    return count == 1 ? known_by : known_by + " (" + std::to_string(count) + ')';
}

std::vector<Held> all_held(const config::Config& config) {
    std::vector<Held> held;
    const Holder top(held, "");
    for (const config::Line& line : config.lines) hold_line(top, line);
    hold_servers(top, config);
    constexpr std::array<const char*, 5> kLevels{"error", "warn", "info", "debug", "trace"};
    Holder log = top.below("log");
    log.tell("level", kLevels[static_cast<std::size_t>(config.log.level)]);
    log.tell("format", config.log.format == rt::LogFormat::json ? "json" : "text");
    Holder realtime = top.below("realtime");
    realtime.tell("priority", config.realtime.priority);
    realtime.tell("lock_memory", config.realtime.lock_memory);
    return held;
}

}  // namespace panelgate::app
