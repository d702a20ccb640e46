#include "logins.hpp"

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

Duration Logins::pause() const { return Duration(1s) / settings_.a_second; }

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
    known->second.free -= pause();  // it was no guess
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

}  // namespace panelgate::web
