#pragma once

#include <string>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"

/// Explains the decisions of the schedule, one line each. Called only with Settings::explain.
namespace panelgate::arbiter::explain {

Reason start(TimePoint now, const Group& group, const JobQueue& queue, const ClientNames& names);
std::string offline(TimePoint now, const Job& job, const StationHealth& health,
                    const ClientNames& names);
std::string full(const Job& job, const QueueSettings& settings, std::size_t waiting,
                 const ClientNames& names);
std::string shed(const Job& job, const ClientNames& names);
std::string doubted(const Job& job, const ClientNames& names);
std::string line_rests(Duration rest, const Group& group);
std::string expired(TimePoint now, const Job& job, bool transmitted, const ClientNames& names);

}  // namespace panelgate::arbiter::explain
