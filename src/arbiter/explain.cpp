// Why the schedule decides as it does, in one line a decision.

#include <string>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {
namespace {

std::string ms(Duration duration) {
    const auto tenths = duration / 100us;
    return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " ms";
}

std::string_view word(PriorityClass priority) {
    switch (priority) {
        case PriorityClass::write:
            return "write";
        case PriorityClass::read:
            return "read";
        case PriorityClass::poll:
            return "poll";
        case PriorityClass::probe:
            return "probe";
    }
    std::abort();
}

std::string who(const Job& job) {
    return std::string(word(job.priority)) + " of client " + std::to_string(job.client) +
           " to station " + std::to_string(job.station);
}

}  // namespace

std::string Arbiter::why(TimePoint now, const Group& group) const {
    if (!settings_.explain) return {};
    if (group.learns_for != 0)
        return "a write is next and nobody knows whether this line has an echo";
    if (group.probe) return "the station is offline and its probe is due";
    const Job& leader = group.jobs.front();
    std::string text = who(leader) + ": ";
    if (group.attempts > 1) return text + "attempt " + std::to_string(group.attempts);
    text += "next in turn after " + ms(now - leader.arrived) + ", " +
            std::to_string(queue_.size()) + " wait";
    if (queue_.last_was_aged()) text += ", ahead of a higher class because of its age";
    if (group.jobs.size() > 1) {
        text += ", answers " + std::to_string(group.jobs.size()) + " requests in one";
    }
    return text;
}

void Arbiter::explain_refusal(TimePoint now, const Job& job, Fault fault) {
    if (!settings_.explain) return;
    std::string text = who(job) + " refused: ";
    if (fault == Fault::offline) {
        const StationHealth& health = station_of(job.station).health;
        text += "offline after " + std::to_string(health.silent_in_a_row()) +
                " silent transactions, next probe in " +
                ms(std::max(health.next_probe() - now, Duration::zero()));
    } else {
        text += std::to_string(queue_.size()) + " of " + std::to_string(settings_.queue.limit) +
                " wait on this line, at most " + std::to_string(settings_.queue.per_client) +
                " of one client";
    }
    actions_.push_back(Decision{now, std::move(text)});
}

void Arbiter::explain_quarantine(TimePoint now, const Group& group) {
    if (!settings_.explain) return;
    actions_.push_back(Decision{now, "nobody but this request for " + ms(quarantined_until_ - now) +
                                         ": station " + std::to_string(group.station) +
                                         " did not answer and may do so late"});
}

void Arbiter::explain_end(TimePoint now, const Job& job, Fault fault) {
    if (!settings_.explain) return;
    const bool sent = fault == Fault::timeout;
    actions_.push_back(Decision{now, who(job) + " given up after " + ms(now - job.arrived) +
                                         (sent ? ": no answer before its deadline"
                                               : ": it could not end before its deadline")});
}

}  // namespace panelgate::arbiter
