#include "panelgate/rt/log_throttle.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::rt {

namespace {

std::string key_of(std::string_view event, std::string_view subject) {
    std::string key(event);
    key += '\0';
    key += subject;
    return key;
}

}  // namespace

std::optional<std::uint64_t> LogThrottle::pass(TimePoint now, std::string_view event,
                                               std::string_view subject, const Pace& pace) {
    std::string key = key_of(event, subject);
    auto found = seen_.find(key);
    if (found == seen_.end()) {
        make_room(now);
        found = seen_.emplace(std::move(key), Seen{now, pace.interval, pace.burst}).first;
    }
    Seen& seen = found->second;
    // Credit comes back one at a time: what was quiet for long may speak freely again.
    const auto earned = (now - seen.last) / pace.interval;
    if (earned > 0)
        seen.credit = static_cast<int>(std::min<std::int64_t>(pace.burst, seen.credit + earned));
    if (seen.credit == 0) {
        ++seen.left_out;
        return std::nullopt;
    }
    --seen.credit;
    seen.last = now;
    seen.held.reset();
    return std::exchange(seen.left_out, 0);
}

void LogThrottle::hold(std::string_view event, std::string_view subject, LogLevel level,
                       LogLine line) {
    const auto found = seen_.find(key_of(event, subject));
    if (found == seen_.end()) return;
    found->second.level = level;
    found->second.held = std::move(line);
}

std::vector<LogThrottle::Held> LogThrottle::take_held(TimePoint now) {
    std::vector<Held> all;
    for (auto& [key, seen] : seen_) {
        if (!seen.held || now - seen.last < seen.interval) continue;
        all.push_back({seen.level, std::move(*seen.held), seen.left_out - 1});
        seen.held.reset();
        seen.left_out = 0;
        seen.last = now;
    }
    return all;
}

/// Whoever has been quiet for an interval is as good as new; if nobody has, the one quiet longest.
void LogThrottle::make_room(TimePoint now) {
    if (seen_.size() < kMostSubjects) return;
    std::erase_if(
        seen_, [&](const auto& entry) { return now - entry.second.last >= entry.second.interval; });
    if (seen_.size() < kMostSubjects) return;
    seen_.erase(
        std::ranges::min_element(seen_, {}, [](const auto& entry) { return entry.second.last; }));
}

}  // namespace panelgate::rt
