#include "explain.hpp"

#include <algorithm>

namespace panelgate::arbiter::explain {
namespace {

std::string ms(Duration duration) {
    const auto tenths = duration / 100us;
    return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " ms";
}

/// "read of modbus_tcp 10.0.0.5:50012 to station 17"; who polls is called after what it polls.
std::string who(const Job& job, const ClientNames& names) {
    const std::string name = names.of(job.client);
    const std::string own = std::string(label(job.priority)) + " of ";
    if (name.starts_with(own)) return name;
    return own + name + " to station " + std::to_string(job.station);
}

}  // namespace

std::string start(TimePoint now, const Group& group, const JobQueue& queue,
                  const ClientNames& names) {
    if (group.learns_for != 0)
        return "a write is next and nobody knows whether this line has an echo";
    if (group.probe) return "the station is offline and its probe is due";
    const Job& leader = group.jobs.front();
    std::string text = who(leader, names) + ": ";
    if (group.attempts > 1) return text + "attempt " + std::to_string(group.attempts);
    text += "next in turn after " + ms(now - leader.arrived) + ", " +
            std::to_string(queue.waiting()) + " wait";
    if (queue.last_was_passed_over()) text += ", ahead of a higher class that has had its turns";
    if (group.jobs.size() > 1) {
        text += ", answers " + std::to_string(group.jobs.size()) + " requests in one";
    }
    return text;
}

std::string offline(TimePoint now, const Job& job, const StationHealth& health,
                    const ClientNames& names) {
    return who(job, names) + " refused: offline after " + std::to_string(health.silent_in_a_row()) +
           " silent transactions, next probe in " +
           ms(std::max(health.next_probe() - now, Duration::zero()));
}

std::string full(const Job& job, const QueueSettings& settings, std::size_t waiting,
                 const ClientNames& names) {
    return who(job, names) + " refused: " + std::to_string(waiting) + " of " +
           std::to_string(settings.limit) + " wait on this line, at most " +
           std::to_string(settings.per_client) + " of one client";
}

std::string shed(const Job& job, const ClientNames& names) {
    return who(job, names) + " given up: the queue is full, and its host has the most waiting";
}

std::string line_rests(Duration rest, const Group& group) {
    return "nobody but this request for " + ms(rest) + ": station " +
           std::to_string(group.station) + " did not answer and may do so late";
}

std::string expired(TimePoint now, const Job& job, bool transmitted, const ClientNames& names) {
    return who(job, names) + " given up after " + ms(now - job.arrived) +
           (transmitted ? ": no answer before its deadline"
                        : ": it could not end before its deadline");
}

}  // namespace panelgate::arbiter::explain
