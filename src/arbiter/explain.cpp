#include "explain.hpp"

#include <algorithm>
#include <cstdlib>

namespace panelgate::arbiter::explain {
namespace {

std::string ms(Duration duration) {
    const auto tenths = duration / 100us;
    return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " ms";
}

/// "read of modbus_tcp 10.0.0.5:50012 to station 17"; a poller's name already says what it polls.
std::string describe(PriorityClass priority, const std::string& name, std::uint8_t station) {
    const std::string own = std::string(label(priority)) + " of ";
    if (name.starts_with(own)) return name;
    return own + name + " to station " + std::to_string(station);
}
std::string describe(const Job& job, const ClientNames& names) {
    return describe(job.priority, names.of(job.client), job.station);
}

/// Explains a request that is sent.
std::string turn(const Reason& reason) {
    const std::string text =
        describe(reason.priority, ClientNames::words(reason.client), reason.station) + ": ";
    const std::string instead =
        reason.asked_function == 0
            ? ""
            : ", instead of function " + std::to_string(reason.asked_function);
    if (reason.kind == Reason::Kind::again)
        return text + "attempt " + std::to_string(reason.attempt) + instead;
    return text + "next in turn after " + ms(reason.waited) + ", " +
           std::to_string(reason.waiting) + " wait" +
           (reason.passed_over ? ", ahead of a higher class that has had its turns" : "") +
           (reason.answers > 1 ? ", answers " + std::to_string(reason.answers) + " requests in one"
                               : "") +
           instead;
}

}  // namespace

Reason start(TimePoint now, const Group& group, const JobQueue& queue, const ClientNames& names) {
    Reason reason;
    if (group.learns_for != 0 || !group.confirms.empty() || group.probe) {
        const bool learns = !group.probe;
        reason.kind = learns ? Reason::Kind::learns_echo : Reason::Kind::probe;
        return reason;
    }
    const Job& leader = group.jobs.front();
    reason.kind = group.attempts > 1 ? Reason::Kind::again : Reason::Kind::turn;
    reason.priority = leader.priority;
    reason.station = leader.station;
    reason.asked_function = leader.asked_function;
    reason.passed_over = queue.last_was_passed_over();
    reason.attempt = group.attempts;
    reason.waited = now - leader.arrived;
    reason.waiting = queue.waiting();
    reason.answers = group.jobs.size();
    reason.client = names.name(leader.client);
    return reason;
}

std::string offline(TimePoint now, const Job& job, const StationHealth& health,
                    const ClientNames& names) {
    return describe(job, names) + " refused: offline after " +
           std::to_string(health.silent_in_a_row()) + " silent transactions, next probe in " +
           ms(std::max(health.next_probe() - now, Duration::zero()));
}

std::string full(const Job& job, const QueueSettings& settings, std::size_t waiting,
                 const ClientNames& names) {
    return describe(job, names) + " refused: " + std::to_string(waiting) + " of " +
           std::to_string(settings.limit) + " wait on this line, at most " +
           std::to_string(settings.per_client) + " of one client";
}

std::string shed(const Job& job, const ClientNames& names) {
    return describe(job, names) + " given up: the queue is full, and its host has the most waiting";
}

std::string doubted(const Job& job, const ClientNames& names) {
    return describe(job, names) +
           " asked once more: its answer repeats an earlier one and may be a duplicate of it";
}

std::string line_rests(Duration rest, const Group& group) {
    return "only this request is sent for " + ms(rest) + ": station " +
           std::to_string(group.station) + " did not answer and may do so late";
}

std::string expired(TimePoint now, const Job& job, bool transmitted, const ClientNames& names) {
    return describe(job, names) + " given up after " + ms(now - job.arrived) +
           (transmitted ? ": no answer before its deadline"
                        : ": it could not end before its deadline");
}

}  // namespace panelgate::arbiter::explain

namespace panelgate::arbiter {

std::string text_of(const Reason& reason) {
    switch (reason.kind) {
        case Reason::Kind::none:
            return "";
        case Reason::Kind::learns_echo:
            return "a write is next and it is unknown whether this line has an echo";
        case Reason::Kind::probe:
            return "the station is offline and its probe is due";
        case Reason::Kind::again:
        case Reason::Kind::turn:
            return explain::turn(reason);
    }
    std::abort();
}

}  // namespace panelgate::arbiter
