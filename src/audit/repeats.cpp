#include "panelgate/audit/repeats.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

namespace panelgate::audit {

namespace {

constexpr std::string_view kOthers = "\xFF";  // no key of a client
constexpr std::string_view kOthersMembers = R"(,"client":"others")";
constexpr std::string_view kOtherPlaces = R"(,"at":"other places")";

}  // namespace

bool Repeats::has_many(std::string_view client) const {
    std::size_t count = 0;
    for (auto it = entries_.lower_bound(client); it != entries_.end(); ++it) {
        if (!it->first.starts_with(client)) return false;
        if (++count >= kMostOfOne) return true;
    }
    return false;
}

/// Room for a new key comes back with time.
bool Repeats::may_begin(TimePoint now) {
    const std::int64_t earned = std::max<std::int64_t>(0, (now - filled_) / kNewEach);
    if (room_ + earned >= kNewAtOnce) {
        room_ = kNewAtOnce;
        filled_ = now;
    } else {
        room_ += static_cast<int>(earned);
        filled_ += earned * kNewEach;
    }
    if (room_ == 0 || entries_.size() >= kMost) return false;
    --room_;
    return true;
}

bool Repeats::is_new(TimePoint now, WallTime wall, std::string_view key, unsigned in_full,
                     const std::function<std::string()>& members, const Client& client) {
    auto found = entries_.find(key);
    if (found == entries_.end() && !client.key.empty() && has_many(client.key)) {
        const std::string rest = std::string(client.key) + std::string(kOthers);
        return is_new(now, wall, rest, 0,
                      [&] { return client.members() + std::string(kOtherPlaces); });
    }
    if (found == entries_.end() && may_begin(now)) {
        found = entries_.emplace(std::string(key), Entry{now, 0, {members(), 0, {}, {}}}).first;
    } else if (found == entries_.end()) {
        const Entry others{now, 0, {std::string(kOthersMembers), 0, {}, {}}};
        found = entries_.try_emplace(std::string(kOthers), others).first;
    }
    Entry& entry = found->second;
    if (entry.in_full < in_full) {
        ++entry.in_full;
        return true;
    }
    if (entry.counted.count++ == 0) entry.counted.first = wall;
    entry.counted.last = wall;
    return false;
}

std::vector<Repeats::Counted> Repeats::due(TimePoint now, bool all) {
    std::vector<Counted> counted;
    for (auto it = entries_.begin(); it != entries_.end();) {
        Entry& entry = it->second;
        const Duration waited = now - entry.since;
        if (entry.counted.count == 0) {
            it = all || waited >= kInterval ? entries_.erase(it) : std::next(it);
            continue;
        }
        if (all || waited >= entry.step) {
            counted.push_back(entry.counted);  // it goes on: what comes is counted, too
            entry.counted.count = 0;
            entry.since = now;
            entry.step = std::min<Duration>(2 * entry.step, kInterval);
        }
        ++it;
    }
    return counted;
}

}  // namespace panelgate::audit
