#include "admission.hpp"

#include <algorithm>

namespace panelgate::web {

void WrongTokens::add(TimePoint now, const HostKey& host) {
    const auto is_over = [&](const auto& entry) {
        return now - entry.second.since >= settings_.within;
    };
    if (counts_.size() >= settings_.addresses) std::erase_if(counts_, is_over);
    if (counts_.size() >= settings_.addresses && !counts_.contains(host))
        counts_.erase(std::ranges::min_element(
            counts_, {}, [](const auto& entry) { return entry.second.since; }));
    const auto [entry, is_new] = counts_.try_emplace(host, Count{0, now});
    if (is_over(*entry)) entry->second = {0, now};
    ++entry->second.wrong;
}

Duration WrongTokens::barred_for(TimePoint now, const HostKey& host) const {
    const auto count = counts_.find(host);
    if (count == counts_.end() || count->second.wrong <= settings_.most) return Duration::zero();
    return std::max(count->second.since + settings_.within - now, Duration::zero());
}

void Places::apply(const Settings& settings) {
    limit_ = settings.max_connections;
    limit_of_address_ = settings.max_connections_per_address;
    limit_of_streams_ = settings.max_streams_per_address;
    limit_of_probes_ = settings.probe_places;
}

Places::Arrival Places::arrive(Id id, const HostKey& host) {
    Arrival arrival;
    const std::size_t own = count(false, &host) - streams(host);
    if (own >= limit_of_address_) {
        arrival.leaves = longest_idle(false, &host);
        arrival.probes_only = !arrival.leaves;
    } else if (count(false) >= limit_) {
        arrival.leaves = longest_idle(false);
        arrival.probes_only = !arrival.leaves;
    }
    if (arrival.probes_only && count(true) >= limit_of_probes_) arrival.leaves = longest_idle(true);
    if (arrival.leaves) leave(*arrival.leaves);
    guests_[id] = {host, arrival.probes_only, State::idle, ++turn_};
    return arrival;
}

void Places::busy(Id id) { set(id, State::busy); }

bool Places::stream(Id id) {
    const auto guest = guests_.find(id);
    if (guest == guests_.end()) return true;
    if (streams(guest->second.host) >= limit_of_streams_) return false;
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

std::size_t Places::count(bool probes_only, const HostKey* host) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        const Guest& guest = entry.second;
        return guest.probes_only == probes_only && (!host || guest.host == *host);
    }));
}

std::size_t Places::streams(const HostKey& host) const {
    return static_cast<std::size_t>(std::ranges::count_if(guests_, [&](const auto& entry) {
        return entry.second.state == State::streaming && entry.second.host == host;
    }));
}

std::optional<Places::Id> Places::longest_idle(bool probes_only, const HostKey* host) const {
    std::optional<Id> found;
    std::uint64_t since = 0;
    for (const auto& [id, guest] : guests_) {
        if (guest.state != State::idle || guest.probes_only != probes_only) continue;
        if (host && guest.host != *host) continue;
        if (found && guest.since > since) continue;
        found = id;
        since = guest.since;
    }
    return found;
}

}  // namespace panelgate::web
