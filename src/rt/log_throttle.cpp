#include "panelgate/rt/log_throttle.hpp"

#include <algorithm>
#include <functional>
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

/// Returns the event of a key_of() it.
std::string_view event_in(std::string_view key) { return key.substr(0, key.find('\0')); }

}  // namespace

bool LogThrottle::Budget::take() {
    if (credit <= 0) return false;
    --credit;
    return true;
}

void LogThrottle::Budget::leave_out(TimePoint at, std::uint64_t lines, std::string_view of) {
    since = left_out == 0 ? at : std::min(since, at);
    left_out += lines;
    if (!of.empty() && clients.size() < kMostClients && !clients.contains(of)) clients.emplace(of);
}

bool LogThrottle::Budget::is_due(TimePoint now) const {
    return left_out > 0 && (now == TimePoint::max() || now - since >= kLeftOutPause);
}

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
    Seen& seen =
        found != seen_.end() ? found->second : new_subject(now, std::move(key), pace, client);
    --seen.credit;
    seen.last = now;
    seen.held.reset();
    return std::exchange(seen.left_out, 0);
}

LogThrottle::Seen& LogThrottle::new_subject(TimePoint now, std::string key, const Pace& pace,
                                            std::string_view client) {
    make_room(now);
    Seen fresh{now, pace.interval, pace.burst};
    fresh.client = client;
    return seen_.emplace(std::move(key), std::move(fresh)).first->second;
}

bool LogThrottle::is_within_budget(TimePoint now, std::string_view event, std::string_view client) {
    if (client.empty()) {
        Budget& all = budget(event_budgets_, now, event, {}, kByEvent);
        if (all.take()) return true;
        all.leave_out(now, 1);
        return false;
    }
    Budget& own = budget(client_budgets_, now, event, client, kByClient);
    if (own.credit <= 0) {
        own.leave_out(now, 1);
        return false;
    }
    Budget& all = all_clients(now, event);
    const bool passes = all.take();
    if (passes) {
        --own.credit;
    } else {
        all.leave_out(now, 1, client);
    }
    make_room_for_client(now);
    return passes;
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
    const auto earned = std::max<std::int64_t>(0, (now - one.filled) / pace.interval);
    one.credit = static_cast<int>(std::min<std::int64_t>(pace.burst, one.credit + earned));
    one.filled += earned * pace.interval;
    return one;
}

LogThrottle::Budget& LogThrottle::all_clients(TimePoint now, std::string_view event) {
    return budget(all_clients_budgets_, now, event, {}, kByClients);
}

/// Evicts the client that was quiet longest; its count moves to that of all clients.
void LogThrottle::make_room_for_client(TimePoint now) {
    if (client_budgets_.size() <= kMostClients) return;
    const auto oldest = std::ranges::min_element(
        client_budgets_, {}, [](const auto& entry) { return entry.second.filled; });
    const Budget& gone = oldest->second;
    if (gone.left_out > 0) all_clients(now, gone.event).leave_out(now, gone.left_out, gone.client);
    client_budgets_.erase(oldest);
}

/// Moves all due counts of clients but the highest to those of all clients.
void LogThrottle::gather_low_counts(TimePoint now) {
    std::vector<Budget*> due;
    for (auto& [key, one] : client_budgets_) {
        if (one.is_due(now)) due.push_back(&one);
    }
    if (due.size() <= kMostTold) return;
    std::ranges::sort(due, std::greater<>(), &Budget::left_out);
    for (std::size_t i = kMostTold; i < due.size(); ++i) {
        Budget& low = *due[i];
        const auto all = all_clients_budgets_.find(key_of(low.event, {}));
        if (all == all_clients_budgets_.end()) continue;
        all->second.leave_out(low.since, std::exchange(low.left_out, 0), low.client);
    }
}

std::vector<LogThrottle::LeftOut> LogThrottle::take_left_out(TimePoint now) {
    gather_low_counts(now);
    std::vector<LeftOut> told;
    for (Budgets* budgets : {&client_budgets_, &all_clients_budgets_, &event_budgets_}) {
        for (auto& [key, one] : *budgets) {
            if (!one.is_due(now)) continue;
            told.push_back({one.event, one.client, std::exchange(one.left_out, 0),
                            std::exchange(one.clients, {}).size()});
        }
    }
    return told;
}

/// A line that its budget has left out is counted there, not by its subject.
void LogThrottle::hold(std::string_view event, std::string_view subject, LogLevel level,
                       LogLine line) {
    const auto found = seen_.find(key_of(event, subject));
    if (found == seen_.end() || found->second.left_out == 0) return;
    found->second.level = level;
    found->second.held = std::move(line);
}

std::vector<LogThrottle::Held> LogThrottle::take_kept(TimePoint now) {
    std::vector<Held> all;
    for (auto& [key, seen] : seen_) {
        if (!seen.held || now - seen.last < seen.interval) continue;
        if (may_be_logged(now, key, seen)) {
            all.push_back({seen.level, std::move(*seen.held), seen.left_out - 1});
            seen.last = now;
        }
        seen.held.reset();
        seen.left_out = 0;
    }
    return all;
}

/// Of any number of subjects, kept lines would fill the log, too.
bool LogThrottle::may_be_logged(TimePoint now, const std::string& key, const Seen& seen) {
    if (seen.client.empty()) return true;
    Budget& all = all_clients(now, event_in(key));
    if (all.take()) return true;
    all.leave_out(now, seen.left_out, seen.client);
    return false;
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
