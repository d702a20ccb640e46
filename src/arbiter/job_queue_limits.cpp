// Who is let into the queue, and who has to leave it for that.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/job_queue.hpp"

namespace panelgate::arbiter {

JobQueue::Admission JobQueue::push(Job job) {
    Admission admission;
    if (waiting() >= kMost) return admission;
    Entry entry = entry_of(std::move(job));
    if (!entry.span || !reads_.carries(*entry.span)) {
        if (counting_of(entry.job.client) >= settings_.per_client) return admission;
        if (size_ >= settings_.limit && !make_room(entry.job, admission.shed)) return {};
    }
    admission.taken = true;
    insert(std::move(entry));
    return admission;
}

/// When the victim carried others, these count in its place and may have to go as well. Tried on a
/// copy: either there is room in the end, or nothing changes.
bool JobQueue::make_room(const Job& newcomer, Jobs& shed) {
    const auto first = find_victim(newcomer);
    if (!first) return false;
    if (first->merit.makes_room) {
        shed.push_back(take(first->place, first->index));
        return true;
    }
    JobQueue after = *this;
    while (after.size_ >= settings_.limit) {
        const auto victim = after.find_victim(newcomer);
        if (!victim) return false;
        shed.push_back(after.take(victim->place, victim->index));
    }
    *this = std::move(after);
    return true;
}

std::size_t JobQueue::counting_of(Client client) const {
    const auto home = home_.find(client);
    return home == home_.end() ? 0 : hosts_.at(home->second).sources.at(client).counting;
}

std::optional<JobQueue::Victim> JobQueue::find_victim(const Job& newcomer) const {
    const HostKey own = host_of(newcomer);
    const auto origin = hosts_.find(own);
    const std::size_t of_host = origin == hosts_.end() ? 0 : origin->second.counting;
    const std::size_t of_client = counting_of(newcomer.client);
    const bool write = newcomer.priority == PriorityClass::write;
    const auto writes_too = [&](const Holder& holder) {
        return write || 2 * holder.origin.counting > size_;
    };
    auto victim = greediest(
        [&](const Holder& holder) { return holder.origin.counting > of_host + 1; }, writes_too);
    if (victim) return victim;
    victim = greediest(
        [&](const Holder& holder) {
            return holder.host == own && holder.source.counting > of_client + 1;
        },
        writes_too);
    // Writes come first, but the places of reads that every fifth turn needs are not theirs.
    if (victim || !write || kReadTurn * reads_.counting() <= settings_.limit) return victim;
    return greediest(
        [&](const Holder& holder) {
            return holder.host == own ? holder.source.counting >= of_client
                                      : holder.origin.counting >= of_host;
        },
        [](const Holder&) { return false; });
}

/// The victim of the greediest client that has one. Among equals the newest request loses: if it
/// were always the same client's, nothing of that client would ever be served.
std::optional<JobQueue::Victim> JobQueue::greediest(const Ask& may_lose,
                                                    const Ask& writes_too) const {
    std::optional<Victim> best;
    std::pair<std::size_t, std::size_t> most;
    for (const auto& [host, origin] : hosts_) {
        for (const auto& [client, source] : origin.sources) {
            const std::pair load(origin.counting, source.counting);
            const Holder holder{host, origin, client, source};
            if ((best && load < most) || !may_lose(holder)) continue;
            const auto victim = victim_of(holder, writes_too(holder));
            if (!victim || (best && load == most && victim->merit < best->merit)) continue;
            best = victim;
            most = load;
        }
    }
    return best;
}

std::optional<JobQueue::Victim> JobQueue::victim_of(const Holder& holder, bool writes_too) const {
    std::optional<Victim> best;
    for (const auto& [station, lane] : holder.source.lanes) {
        const auto victim = victim_in(holder, station);
        if (!victim || (victim->merit.is_write && !writes_too)) continue;
        if (!best || best->merit < victim->merit) best = victim;
    }
    return best;
}

/// The newest of a lane whose removal makes room; if none does, because others would count in its
/// place, the newest that counts. Only reads stay behind it, so order is not broken by its loss;
/// for the same reason nothing younger may wait on the other side of a broadcast.
std::optional<JobQueue::Victim> JobQueue::victim_in(const Holder& holder,
                                                    std::uint8_t station) const {
    const auto& lanes = holder.source.lanes;
    const auto& jobs = lanes.at(station).jobs;
    std::optional<Victim> found;
    for (std::size_t i = jobs.size(); i-- > 0;) {
        const auto& [job, span] = jobs[i];
        const bool frees = !span || reads_.frees(job.ticket, *span);
        if (!frees && (found || !reads_.counts(job.ticket, *span))) continue;
        const std::size_t rank = rank_of(job);
        found = Victim{Place{holder.host, holder.client, station}, i,
                       Merit{rank == 0, frees, rank, job.ticket}};
        if (frees) break;
    }
    const auto younger_beyond = [&](const auto& other) {
        const bool beyond = other.first != station && (station == 0 || other.first == 0);
        return beyond && other.second.jobs.back().job.ticket > found->merit.ticket;
    };
    if (found && std::ranges::any_of(lanes, younger_beyond)) return std::nullopt;
    return found;
}

}  // namespace panelgate::arbiter
