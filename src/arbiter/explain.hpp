#pragma once

#include <string>

#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"

/// Why the schedule decides as it does, in one line a decision. Called only where somebody wants to
/// read it.
namespace panelgate::arbiter::explain {

std::string start(TimePoint now, const Group& group, const JobQueue& queue);
std::string offline(TimePoint now, const Job& job, const StationHealth& health);
std::string full(const Job& job, const QueueSettings& settings, std::size_t waiting);
std::string shed(const Job& job);
std::string line_rests(Duration rest, const Group& group);
std::string expired(TimePoint now, const Job& job, bool transmitted);

}  // namespace panelgate::arbiter::explain
