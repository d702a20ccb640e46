#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

/// Explains the decisions of the schedule, one line each. Called only with Settings::explain.

namespace panelgate::arbiter {

inline constexpr std::uint8_t kBroadcast = 0;
inline constexpr std::uint8_t kUnlisted = 0;  ///< key in the counters

/// True if the bytes begin with another master's request: not our own frame, which an adapter
/// configured without echo may return. The reply framer would take a request followed by its reply
/// for damage.
inline bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size), orders) &&
           !std::ranges::equal(heard.first(size), own);
}

/// True if this job's items are among those of a transaction with its station.
inline bool contained_in(const std::optional<modbus::Span>& span, const Job& job) {
    if (!span || job.alone) return false;
    const auto& own = job.request.span();
    return own && span->contains(*own);
}

}  // namespace panelgate::arbiter

namespace panelgate::arbiter::explain {

Reason start(TimePoint now, const Group& group, const JobQueue& queue, const ClientNames& names);
std::string offline(TimePoint now, const Job& job, const StationHealth& health,
                    const ClientNames& names);
std::string full(const Job& job, const QueueSettings& settings, std::size_t waiting,
                 const ClientNames& names);
std::string shed(const Job& job, const ClientNames& names);
std::string doubted(const Job& job, const ClientNames& names);
/// A station's condition has changed.
std::string condition(std::uint8_t station, Condition now);
std::string line_rests(Duration rest, const Group& group);
std::string expired(TimePoint now, const Job& job, bool transmitted, const ClientNames& names);

}  // namespace panelgate::arbiter::explain
