#include "panelgate/bus/last_minute.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "panelgate/base/network.hpp"

namespace panelgate::bus {

namespace {

constexpr Duration kMinute = 1min;

std::uint64_t beyond(std::uint64_t now, std::uint64_t before) {
    return now - std::min(now, before);
}

/// The clients of one address, whether they are connected or have left. The row for all others is
/// left out: clients that left long ago are added there.
std::map<std::string, HostUse> hosts_of(const std::vector<ClientShare>& clients) {
    std::map<std::string, HostUse> hosts;
    for (const ClientShare& client : clients) {
        if (client.name == kOtherClients) continue;
        const std::string name = client.address ? HostKey(*client.address).text() : client.name;
        HostUse& host = hosts[name];
        host.requests += client.requests;
        host.failed += client.failed;
        host.busy += client.busy;
        if (!client.last_error) continue;
        if (host.last_error && host.last_error_ago < client.last_error_ago) continue;
        host.last_error = client.last_error;
        host.last_error_ago = client.last_error_ago;
    }
    return hosts;
}

std::vector<HostUse> hosts_since(const std::map<std::string, HostUse>& before,
                                 const std::map<std::string, HostUse>& now, Duration busy) {
    std::vector<HostUse> list;
    for (const auto& [name, host] : now) {
        const auto found = before.find(name);
        const HostUse was = found == before.end() ? HostUse() : found->second;
        HostUse used = host;
        used.name = name;
        used.requests = beyond(host.requests, was.requests);
        used.failed = beyond(host.failed, was.failed);
        used.busy = std::max(host.busy - was.busy, Duration::zero());
        if (used.requests > 0 || used.busy > Duration::zero()) list.push_back(std::move(used));
    }
    for (HostUse& host : list)
        host.percent = busy > Duration::zero()
                           ? std::min(100.0, 100 * to_seconds(host.busy) / to_seconds(busy))
                           : 0;
    std::ranges::sort(list, std::ranges::greater(), &HostUse::busy);
    return list;
}

}  // namespace

LastMinute::Mark LastMinute::mark_of(TimePoint at, const LineReport& report,
                                     const std::vector<ClientShare>& clients) {
    Mark mark{at, report.wire.busy, {}, {}, hosts_of(clients)};
    for (const StationReport& station : report.stations) {
        const RequestCounts counts = counts_of(station);
        mark.all += counts;
        if (counts.requests > 0) mark.stations[station.station] = counts;
    }
    return mark;
}

void LastMinute::record(TimePoint now, const LineReport& report,
                        const std::vector<ClientShare>& clients) {
    marks_.push_back(mark_of(now, report, clients));
    while (marks_.size() > 1 && now - marks_[1].at >= kMinute) marks_.pop_front();
}

MinuteUse LastMinute::use(TimePoint now, const LineReport& report,
                          const std::vector<ClientShare>& clients) const {
    MinuteUse use;
    if (marks_.empty()) return use;
    const Mark here = mark_of(now, report, clients);
    const Mark& before = marks_.front();
    use.span = now - before.at;
    if (use.span > Duration::zero())
        use.load_percent = std::clamp(
            100 * to_seconds(here.busy - before.busy) / to_seconds(use.span), 0.0, 100.0);
    for (const auto& [name, counts] : here.stations) {
        const auto was = before.stations.find(name);
        const RequestCounts used =
            difference(counts, was == before.stations.end() ? RequestCounts() : was->second);
        if (used.requests == 0 && used.transactions == 0) continue;
        use.stations[name] = used;
        use.all += used;
    }
    use.hosts = hosts_since(before.hosts, here.hosts, here.busy - before.busy);
    use.refuses = marks_.back().at - before.at >= kMinute;
    for (std::size_t i = 1; i < marks_.size(); ++i)
        use.refuses = use.refuses && marks_[i].all.no_turn > marks_[i - 1].all.no_turn;
    return use;
}

}  // namespace panelgate::bus
