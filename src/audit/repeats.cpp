#include "panelgate/audit/repeats.hpp"

#include <utility>

namespace panelgate::audit {

bool Repeats::is_new(TimePoint now, WallTime wall, const Members& client, const Members& what) {
    Members who = client;
    Members which = what;
    const bool is_crowded = counts_.size() >= kClients && !counts_.contains(body_of(who));
    if (is_crowded) who = {{"client", "others"}};
    auto& of_client = counts_[body_of(who)];
    const bool has_many = of_client.size() >= kMostOfOne && !of_client.contains(body_of(which));
    if (is_crowded || has_many) which = {{"at", "other places"}};
    const auto [entry, begins] = of_client.try_emplace(body_of(which));
    Count& count = entry->second;
    if (begins) {
        count.members = std::move(who);
        add(count.members, which);
        count.since = now;
        if (!is_crowded && !has_many) return true;
    }
    if (count.times++ == 0) count.first = wall;
    count.last = wall;
    return false;
}

std::vector<Members> Repeats::due(TimePoint now, bool all) {
    std::vector<Members> records;
    for (auto& [client, counts] : counts_) {
        for (auto& [what, count] : counts) {
            if (count.times == 0 || (!all && now - count.since < kInterval)) continue;
            Members& record = records.emplace_back(Members{{"count", count.times},
                                                           {"first", time_text(count.first)},
                                                           {"last", time_text(count.last)}});
            add(record, count.members);
            count.times = 0;
            count.since = now;
        }
        std::erase_if(counts, [now](const auto& entry) {
            return entry.second.times == 0 && now - entry.second.since >= kInterval;
        });
    }
    std::erase_if(counts_, [](const auto& entry) { return entry.second.empty(); });
    return records;
}

}  // namespace panelgate::audit
