#include "panelgate/audit/repeats.hpp"

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

bool Repeats::is_new(TimePoint now, WallTime wall, std::string_view key, unsigned in_full,
                     const std::function<std::string()>& members, const Client& client) {
    auto found = entries_.find(key);
    if (found == entries_.end() && !client.key.empty() && has_many(client.key)) {
        const std::string rest = std::string(client.key) + std::string(kOthers);
        return is_new(now, wall, rest, 0,
                      [&] { return client.members() + std::string(kOtherPlaces); });
    }
    if (found == entries_.end() && entries_.size() < kMost) {
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
        if (!all && now - entry.began < kInterval) {
            ++it;
        } else if (entry.counted.count == 0) {
            it = entries_.erase(it);
        } else {
            counted.push_back(entry.counted);  // it goes on: the next interval is counted, too
            entry.counted.count = 0;
            entry.began = now;
            ++it;
        }
    }
    return counted;
}

}  // namespace panelgate::audit
