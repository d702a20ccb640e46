#include "panelgate/rt/log_repeats.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::rt {

bool LogRepeats::is_repeat(TimePoint now, std::string_view place, std::string_view what) {
    auto found = places_.find(place);
    if (found == places_.end()) {
        make_room();
        places_.emplace(place, Last{std::string(what), now});
        return false;
    }
    Last& last = found->second;
    if (last.what == what && now - last.told < kInterval) return true;
    end(last);
    last.what = what;
    last.told = now;
    return false;
}

void LogRepeats::gather(std::string_view place, LogLine line, WallTime time) {
    const auto found = places_.find(place);
    if (found == places_.end()) return;
    Gathered& gathered = found->second.gathered;
    if (gathered.repeated++ == 0) gathered.first = time;
    gathered.last = time;
    gathered.line = std::move(line);
}

void LogRepeats::end(Last& last) {
    if (last.gathered.repeated > 0) ended_.push_back(std::exchange(last.gathered, {}));
}

std::vector<LogRepeats::Gathered> LogRepeats::take_ended() { return std::exchange(ended_, {}); }

std::vector<LogRepeats::Gathered> LogRepeats::take_due(TimePoint now) {
    for (auto& [place, last] : places_) {
        if (last.gathered.repeated == 0 || now - last.told < kInterval) continue;
        end(last);
        last.told = now;
    }
    return take_ended();
}

/// The place that was told of longest ago gives way.
void LogRepeats::make_room() {
    if (places_.size() < kMostPlaces) return;
    const auto oldest =
        std::ranges::min_element(places_, {}, [](const auto& entry) { return entry.second.told; });
    end(oldest->second);
    places_.erase(oldest);
}

}  // namespace panelgate::rt
