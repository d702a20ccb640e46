#include "panelgate/arbiter/reception.hpp"

#include <utility>

#include "rules.hpp"

namespace panelgate::arbiter {

void Reception::stamp(TimePoint now, Job& job) {
    const std::size_t request = job.pdu.size() + kAduOverhead;
    const Duration shortest =
        job.station == kBroadcast
            ? wire_time(serial_, request)
            : wire_time(serial_, request + kShortestReplyAdu) + silent_interval(serial_);
    job.ticket = ++last_ticket_;
    job.arrived = now;
    job.deadline = now + deadline_;
    job.start_by = job.deadline - shortest;
}

std::optional<Reception::FromMemory> Reception::from_memory(TimePoint now, const Job& job,
                                                            Duration max_age) {
    if (max_age <= Duration::zero() || job.priority == PriorityClass::poll) return std::nullopt;
    const auto span = read_span(job.station, job.pdu);
    if (!span) return std::nullopt;
    auto hit = memory_.find(*span, now, max_age);
    if (!hit) return std::nullopt;
    return FromMemory{++last_ticket_, std::move(*hit)};
}

void Reception::on_read(const Group& group, const Bytes& reply, Duration max_age) {
    if (group.span && max_age > Duration::zero()) memory_.store(*group.span, reply, group.started);
}

}  // namespace panelgate::arbiter
