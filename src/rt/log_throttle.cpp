#include "panelgate/rt/log_throttle.hpp"

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

/// Evicts the place logged longest ago.
void LogRepeats::make_room() {
    if (places_.size() < kMostPlaces) return;
    const auto oldest =
        std::ranges::min_element(places_, {}, [](const auto& entry) { return entry.second.told; });
    end(oldest->second);
    places_.erase(oldest);
}

namespace {

std::string key_of(std::string_view event, std::string_view subject) {
    std::string key(event);
    key += '\0';
    key += subject;
    return key;
}

void count(std::uint64_t& left_out, TimePoint& since, TimePoint now, std::uint64_t more) {
    if (left_out == 0) since = now;
    left_out += more;
}

}  // namespace

std::optional<std::uint64_t> LogThrottle::pass(TimePoint now, std::string_view event,
                                               std::string_view subject, const Pace& pace,
                                               std::string_view client) {
    std::string key = key_of(event, subject);
    const auto found = seen_.find(key);
    if (found != seen_.end()) {
        Seen& seen = found->second;
        // Credit returns one per interval: a subject that was quiet regains its burst.
        const auto earned = (now - seen.last) / pace.interval;
        if (earned > 0)
            seen.credit =
                static_cast<int>(std::min<std::int64_t>(pace.burst, seen.credit + earned));
        if (seen.credit == 0) {
            ++seen.left_out;
            return std::nullopt;
        }
    }
    // A subject beyond the budget is not even stored: there may be any number of them.
    if (!is_within_budget(now, event, client)) return std::nullopt;
    Seen& seen = found != seen_.end() ? found->second : new_subject(now, std::move(key), pace);
    --seen.credit;
    seen.last = now;
    seen.held.reset();
    return std::exchange(seen.left_out, 0);
}

LogThrottle::Seen& LogThrottle::new_subject(TimePoint now, std::string key, const Pace& pace) {
    make_room(now);
    return seen_.emplace(std::move(key), Seen{now, pace.interval, pace.burst}).first->second;
}

bool LogThrottle::is_within_budget(TimePoint now, std::string_view event, std::string_view client) {
    if (!client.empty()) {
        Budget& own = budget(client_budgets_, now, event, client, kByClient);
        if (own.credit == 0) {
            count(own.left_out, own.since, now, 1);
            return false;
        }
        --own.credit;
        make_room_for_client(now);
    }
    Budget& all = budget(event_budgets_, now, event, {}, kByEvent);
    if (all.credit == 0) {
        count(all.left_out, all.since, now, 1);
        return false;
    }
    --all.credit;
    return true;
}

LogThrottle::Budget& LogThrottle::budget(Budgets& budgets, TimePoint now, std::string_view event,
                                         std::string_view client, const Pace& pace) {
    std::string key = key_of(event, client);
    auto found = budgets.find(key);
    if (found == budgets.end()) {
        Budget fresh{std::string(event), std::string(client), now, pace.burst, 0, now};
        found = budgets.emplace(std::move(key), std::move(fresh)).first;
    }
    Budget& one = found->second;
    const auto earned = (now - one.filled) / pace.interval;
    one.credit = static_cast<int>(std::min<std::int64_t>(pace.burst, one.credit + earned));
    one.filled += earned * pace.interval;
    return one;
}

/// Evicts the client that was quiet longest; its count moves to the event's budget.
void LogThrottle::make_room_for_client(TimePoint now) {
    if (client_budgets_.size() <= kMostClients) return;
    const auto oldest = std::ranges::min_element(
        client_budgets_, {}, [](const auto& entry) { return entry.second.filled; });
    const Budget& gone = oldest->second;
    if (gone.left_out > 0) {
        Budget& all = budget(event_budgets_, now, gone.event, {}, kByEvent);
        count(all.left_out, all.since, now, gone.left_out);
    }
    client_budgets_.erase(oldest);
}

std::vector<LogThrottle::LeftOut> LogThrottle::take_left_out(TimePoint now) {
    std::vector<LeftOut> all;
    for (Budgets* budgets : {&client_budgets_, &event_budgets_}) {
        for (auto& [key, one] : *budgets) {
            if (one.left_out == 0 || now - one.since < kLeftOutPause) continue;
            all.push_back({one.event, one.client, std::exchange(one.left_out, 0)});
        }
    }
    return all;
}

void LogThrottle::hold(std::string_view event, std::string_view subject, LogLevel level,
                       LogLine line) {
    const auto found = seen_.find(key_of(event, subject));
    if (found == seen_.end()) return;
    found->second.level = level;
    found->second.held = std::move(line);
}

std::vector<LogThrottle::Held> LogThrottle::take_kept(TimePoint now) {
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

/// Evicts the subjects that were quiet for an interval, or else the one quiet longest.
void LogThrottle::make_room(TimePoint now) {
    if (seen_.size() < kMostSubjects) return;
    std::erase_if(
        seen_, [&](const auto& entry) { return now - entry.second.last >= entry.second.interval; });
    if (seen_.size() < kMostSubjects) return;
    seen_.erase(
        std::ranges::min_element(seen_, {}, [](const auto& entry) { return entry.second.last; }));
}

}  // namespace panelgate::rt
