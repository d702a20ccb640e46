// What a bus is told while it runs, and what it tells.
#include <sys/eventfd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "bus.hpp"

namespace zoo {
namespace {

std::string_view take_word(std::string_view& line) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    return word;
}

int number(std::string_view text) {
    int value = -1;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

std::string field(std::string_view name, std::uint64_t value) {
    return "\"" + std::string(name) + "\": " + std::to_string(value);
}

}  // namespace

std::string Bus::command(std::string_view line) {
    std::string answer = "ok";
    {
        const std::lock_guard lock(mutex_);
        const std::string_view word = take_word(line);
        if (word == "set") {
            if (!set(line)) answer = "what?";
        } else if (word == "cut") {
            cuts_next_ = true;
        } else if (word == "stall" || word == "sever") {
            stop_for(line, word == "sever");
        } else if (word == "unplug") {
            far_end_->unplug();
            ear_.clear();
        } else if (word == "replug") {
            far_end_->plug();
        } else if (word == "stats") {
            answer = stats();
        } else if (word == "writes") {
            answer = writes();
        } else if (word == "reset") {
            counters_ = {};
            writes_.clear();
            for (auto& [unit, station] : stations_) station.panel.served() = {};
        } else {
            answer = "what?";
        }
    }
    ::eventfd_write(wake_, 1);
    return answer;
}

bool Bus::set(std::string_view arguments) {
    const std::string_view who = take_word(arguments);
    const Time at = now();
    const bool all = who == "all";
    const int unit = number(who);
    if (!all && (unit < 0 || unit > 247)) return false;
    for (int i = all ? 0 : unit; i <= (all ? 247 : unit); ++i) {
        if (!habits_[static_cast<std::size_t>(i)].set(arguments, at)) return false;
    }
    find_sources(at);
    return true;
}

void Bus::stop_for(std::string_view milliseconds_text, bool is_severed) {
    stopped_until_ = now() + milliseconds(number(milliseconds_text));
    ear_.stop_until(stopped_until_);
    is_severed_ = is_severed;
    if (is_severed) far_end_->sever(true);
}

std::string Bus::stats() const {
    std::string text = "{\"units\": {";
    for (const auto& [unit, station] : stations_) {
        const Served& s = station.panel.served();
        if (text.back() == '}') text += ", ";
        text += "\"" + std::to_string(unit) + "\": {" + field("asked", s.asked) + ", " +
                field("executed", s.executed) + ", " + field("answered", s.answered) + ", " +
                field("dropped", s.dropped) + "}";
    }
    const Counters& c = counters_;
    return text + "}, " + field("requests", c.requests) + ", " + field("bad", c.bad) + ", " +
           field("broadcasts", c.broadcasts) + ", " + field("unknown", c.unknown) + ", " +
           field("gap_violations", c.gap_violations) + ", " +
           field("collisions", wire_.collisions()) + ", " + field("connections", c.connections) +
           ", " + field("tap_bytes", c.tap_bytes) + "}";
}

// [[nanoseconds, unit, "PDU in hex"], ...], the oldest first.
std::string Bus::writes() const {
    std::string text = "[";
    for (const Write& w : writes_) {
        if (text.size() > 1) text += ", ";
        text += "[" + std::to_string(w.at) + ", " + std::to_string(w.unit) + ", \"";
        for (const std::uint8_t b : w.pdu) {
            constexpr std::string_view digits = "0123456789abcdef";
            text += {digits[b >> 4U], digits[b & 0xFU]};
        }
        text += "\"]";
    }
    return text + "]";
}

}  // namespace zoo
