#include "admission.hpp"

#include <algorithm>

namespace panelgate::web {

Duration Logins::hold(TimePoint now, const std::string& address) const {
    const auto known = known_.find(address);
    return known != known_.end() && guesses(now, known->second) ? settings_.hold : Duration::zero();
}

Duration Logins::turn(TimePoint now, const std::string& address) {
    const auto known = known_.find(address);
    if (known == known_.end() || !guesses(now, known->second)) return Duration::zero();
    Failures& failures = known->second;
    const TimePoint mine = std::clamp(failures.free, now, now + settings_.longest_turn);
    failures.free = mine + pause();
    return mine - now;
}

Duration Logins::pause() const { return Duration(1s) / settings_.checks_per_second; }

bool Logins::guesses(TimePoint now, const Failures& failures) const {
    return count_at(now, failures) > settings_.free;
}

void Logins::failed(TimePoint now, const std::string& address) {
    const bool fresh = !known_.contains(address);
    if (fresh && known_.size() >= settings_.addresses) {
        known_.erase(std::ranges::min_element(known_, {},
                                              [](const auto& entry) { return entry.second.last; }));
    }
    Failures& failures = known_[address];
    const unsigned before = fresh ? 0 : count_at(now, failures);
    failures.count = std::min(before + 1, settings_.remembered);
    failures.last = now;
}

void Logins::succeeded(const std::string& address) {
    const auto known = known_.find(address);
    if (known == known_.end()) return;
    known->second.free -= pause();  // not a guess
    if (known->second.count <= 1) {
        known_.erase(known);
    } else {
        --known->second.count;
    }
}

unsigned Logins::count_at(TimePoint now, const Failures& failures) const {
    const auto forgiven = static_cast<unsigned>(
        std::min<Duration::rep>((now - failures.last) / settings_.forgiven_after, failures.count));
    return failures.count - forgiven;
}

Places::Places(const Settings& settings) { apply(settings); }

void Places::apply(const Settings& settings) {
    limit_ = settings.max_connections;
    limit_of_address_ = settings.max_connections_per_address;
    limit_of_streams_ = settings.max_streams_per_address;
    limit_of_throttled_ = settings.max_throttled;
    limit_of_probes_ = settings.probe_places;
}

Places::Arrival Places::admit(const std::string& address) const {
    Arrival arrival;
    if (counted_connections(address) >= limit_of_address_) {
        arrival.leaves = longest(State::idle, false, &address);
        arrival.probes_only = !arrival.leaves;
    } else if (in_state(address, State::wrong) >= limit_of_throttled_) {
        arrival.leaves = longest(State::wrong, false, &address);
    } else if (guests() >= limit_) {
        arrival.leaves = longest(State::wrong, false);
        if (!arrival.leaves) arrival.leaves = longest(State::idle, false);
        if (!arrival.leaves) arrival.leaves = suspect_of_another(address);
        arrival.probes_only = !arrival.leaves;
    }
    return arrival;
}

Places::Arrival Places::arrive(Id id, const std::string& address) {
    Arrival arrival = admit(address);
    if (arrival.probes_only && probes() >= limit_of_probes_)
        arrival.leaves = longest(State::idle, true);
    if (arrival.leaves) leave(*arrival.leaves);
    guests_[id] = {address, arrival.probes_only, State::idle, ++turn_};
    return arrival;
}

void Places::busy(Id id) { set(id, State::busy); }

void Places::suspect(Id id) { set(id, State::suspect); }

void Places::wrong(Id id) { set(id, State::wrong); }

bool Places::stream(Id id) {
    const auto guest = guests_.find(id);
    if (guest == guests_.end()) return true;
    if (in_state(guest->second.address, State::streaming) >= limit_of_streams_) return false;
    set(id, State::streaming);
    return true;
}

void Places::set(Id id, State state) {
    const auto guest = guests_.find(id);
    if (guest != guests_.end() && !guest->second.probes_only) guest->second.state = state;
}

void Places::idle(Id id) {
    const auto guest = guests_.find(id);
    if (guest == guests_.end() || guest->second.state == State::idle) return;
    guest->second.state = State::idle;
    guest->second.since = ++turn_;
}

void Places::leave(Id id) { guests_.erase(id); }

bool Places::is_throttled(Id id) const {
    const auto guest = guests_.find(id);
    return guest != guests_.end() && guest->second.state == State::wrong;
}

std::size_t Places::probes() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(guests_, [](const auto& entry) { return entry.second.probes_only; }));
}

std::size_t Places::guests() const { return guests_.size() - probes(); }

std::size_t Places::counted_connections(const std::string& address) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        const Guest& guest = entry.second;
        const bool counts_against_limit =
            guest.state != State::wrong && guest.state != State::streaming;
        return !guest.probes_only && counts_against_limit && guest.address == address;
    }));
}

std::size_t Places::in_state(const std::string& address, State state) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        return entry.second.state == state && entry.second.address == address;
    }));
}

std::optional<Places::Id> Places::longest(State state, bool probes_only,
                                          const std::string* address) const {
    std::optional<Id> found;
    std::uint64_t since = 0;
    for (const auto& [id, guest] : guests_) {
        if (guest.state != state || guest.probes_only != probes_only) continue;
        if (address && guest.address != *address) continue;
        if (found && guest.since > since) continue;
        found = id;
        since = guest.since;
    }
    return found;
}

std::optional<Places::Id> Places::suspect_of_another(const std::string& address) const {
    for (const auto& [id, guest] : guests_) {
        if (guest.state == State::suspect && guest.address != address) return id;
    }
    return std::nullopt;
}

Duration RateLimiter::take(TimePoint now, const std::string& address, std::size_t bytes) {
    if (used_until_.size() >= settings_.addresses)
        std::erase_if(used_until_, [&](const auto& entry) { return entry.second <= now; });
    TimePoint& used = used_until_[address];
    const Duration cost = settings_.request + Duration(1s) * bytes / settings_.bytes_per_second;
    used = std::min(std::max(used, now) + cost, now + settings_.burst + settings_.longest_wait);
    return std::max(used - now - settings_.burst, Duration::zero());
}

}  // namespace panelgate::web
