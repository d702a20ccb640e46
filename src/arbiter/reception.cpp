#include "panelgate/arbiter/reception.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

void Reception::stamp(TimePoint now, Job& job) {
    const std::size_t request = job.request.pdu().size() + modbus::kAduOverhead;
    const std::size_t reply =
        std::max(job.request.reply_length().value_or(0), modbus::kExceptionAdu);
    const Duration needed = job.station == kBroadcast ? frame_time(serial_, request)
                                                      : frame_time(serial_, request + reply, 2) +
                                                            silent_interval(serial_);
    job.ticket = ++last_ticket_;
    job.arrived = now;
    job.deadline = now + std::min(deadline_, job.within);
    job.start_by = job.deadline - needed;
}

std::optional<Reception::FromMemory> Reception::from_memory(TimePoint now, const Job& job,
                                                            Duration max_age) {
    if (max_age <= Duration::zero() || job.priority == PriorityClass::poll) return std::nullopt;
    const auto& span = job.request.span();
    if (!span) return std::nullopt;
    auto hit = memory_.find({job.station, *span}, now, max_age);
    if (!hit) return std::nullopt;
    return FromMemory{++last_ticket_, std::move(*hit)};
}

void Reception::on_read(const Group& group, const Bytes& reply, Duration max_age) {
    if (group.span && max_age > Duration::zero())
        memory_.store({group.station, *group.span}, reply, group.started);
}

}  // namespace panelgate::arbiter
