#include "panelgate/arbiter/sharing.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/exception.hpp"

namespace panelgate::arbiter {

namespace {

/// Items of one read that this station is known to answer.
std::uint32_t known_length(const Station& station, const modbus::Span& span) {
    const StationSettings& settings = station.settings();
    const std::uint32_t limit =
        modbus::is_bit_table(span.table) ? settings.max_bits : settings.max_registers;
    return settings.vouched ? limit : std::min(limit, station.longest_read(span.table));
}

}  // namespace

Group Sharing::gather(Job leader, const Station& station, JobQueue& queue) const {
    Group group{.station = leader.station, .request = leader.request};
    if (share_ && !leader.alone) group.span = leader.request.span();
    group.jobs.push_back(std::move(leader));
    while (group.span) {
        const std::uint32_t before = group.span->count;
        for (Job& job : queue.take_all(group.station, [&](const Job& other) {
                 if (!joins(group, other, station)) return false;
                 group.span = join(*group.span, *other.request.span());
                 return true;
             })) {
            group.jobs.push_back(std::move(job));
        }
        if (group.span->count == before) break;
    }
    if (group.span && group.span != group.request.span())
        group.request = modbus::Request::read(*group.span);
    return group;
}

bool Sharing::joins(const Group& group, const Job& job, const Station& station) const {
    if (job.alone || job.station != group.station) return false;
    const auto& span = job.request.span();
    if (!span || !group.span->touches(*span)) return false;
    if (group.span->contains(*span)) return true;
    const modbus::Span both = join(*group.span, *span);
    if (station.owes() && station.is_ambiguous(modbus::Request::read(both))) return false;
    // The whole of one that contains all the others has been asked for by a client.
    if (both != *span && both.count > known_length(station, both)) return false;
    return std::none_of(refused_.begin(), refused_.end(), [&](const ReadSpan& refused) {
        return ReadSpan{job.station, both}.contains(refused);
    });
}

Jobs Sharing::split(Group& group) {
    const auto stays = [&](const Job& job) { return job.request == group.request || job.gone; };
    if (group.joined()) {
        if (refused_.size() >= kRemembered) refused_.pop_front();
        refused_.push_back({group.station, *group.span});
    }
    Jobs parts;
    for (auto job = group.jobs.rbegin(); job != group.jobs.rend(); ++job) {
        if (stays(*job)) continue;
        job->alone = true;
        parts.push_back(*job);
    }
    std::erase_if(group.jobs, [&](const Job& job) { return !stays(job); });
    return parts;
}

Bytes Sharing::part_for(const Group& group, const Bytes& reply, const Job& job) {
    if (job.request == group.request || modbus::exception_of(reply)) return reply;
    return slice_reply(*group.span, reply, *job.request.span());
}

}  // namespace panelgate::arbiter
