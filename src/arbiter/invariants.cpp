// What must always hold, whatever has been heard or asked. Tests call it after every verb.

#include <cstdio>
#include <cstdlib>

#include "panelgate/arbiter/arbiter.hpp"

namespace panelgate::arbiter {

namespace {

void must(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "invariant broken: %s\n", what);
    std::abort();
}

}  // namespace

void Arbiter::check_invariants() const {
    const Backlog& backlog = schedule_.backlog();
    must(backlog.queue().waiting() >= backlog.queue().size(), "those that count are among all");
    must(up_ || !active_, "a line that is down carries nothing");
    must(up_ || backlog.empty(), "a line that is down has nothing waiting");
    must(up_ || !resetting_, "a line that is down is not to be reset");
    backlog.each_retry([&](const Group& group) {
        must(!group.abandoned(), "somebody waits for each retry");
        must(group.attempts > 0, "what is repeated was sent before");
        must(stations_.find(group.station) != nullptr, "its station is known");
    });
    if (active_) {
        const Group& group = active_->group();
        must(group.attempts > 0, "what is on the wire was sent");
        must(active_->deadline() >= active_->timing().started, "an attempt ends behind its start");
        must(!group.probe || group.jobs.empty(), "nobody waits for a probe");
        for (const Job& job : group.jobs) must(job.attempts > 0, "its jobs are on the wire");
        for (const Job& job : group.jobs) must(job.station == group.station, "of one station");
    }
    must(!next_deadline() || !active_ || *next_deadline() <= active_->deadline(),
         "somebody looks at the attempt when its time is over");
}

}  // namespace panelgate::arbiter
