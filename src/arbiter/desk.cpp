#include "panelgate/arbiter/desk.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

Desk::Desk(Settings settings)
    : settings_(std::move(settings)),
      stations_(settings_),
      schedule_(settings_),
      outbox_(settings_) {}

void Desk::adopt(Settings settings) {
    settings_ = std::move(settings);
    stations_.apply(settings_);
    schedule_.apply(settings_);
    outbox_.apply(settings_);
}

std::optional<Result<Ticket>> Desk::answer_at_once(TimePoint now, Job& job, bool has_open) {
    if (!up_ && !suspended_) return Fault::line_down;
    if (auto known = from_memory(now, job, has_open)) {
        outbox_.finish_from_memory(++last_ticket_, std::move(known->pdu), known->age);
        return last_ticket_;
    }
    if (stations_.refuses(now, job)) {
        const StationHealth is = health(job.station);
        outbox_.decide(now, Decision::Kind::offline, job, is.next_probe() - now,
                       static_cast<std::size_t>(is.silent_in_a_row()));
        return Fault::offline;
    }
    job.ticket = ++last_ticket_;
    job.arrived = now;
    job.deadline = now + std::min(settings_.queue.deadline, job.within);
    job.start_by = latest_start(settings_.serial, job);
    job.alone = job.alone || !settings_.share_reads;
    return std::nullopt;
}

/// A recently read value, where `max_age` allows it. Never for polls, which must read new values,
/// nor while the client has a request open there: its own write must be older.
std::optional<ReadCache::Hit> Desk::from_memory(TimePoint now, const Job& job,
                                                bool has_open) const {
    const Duration max_age = stations_.settings(job.station).max_age;
    const auto& span = job.request.span();
    if (max_age <= Duration::zero() || job.priority == PriorityClass::poll || !span || has_open ||
        schedule_.backlog().has(job.client, job.station))
        return std::nullopt;
    return memory_.find({job.station, *span}, now, max_age);
}

Result<Ticket> Desk::enqueue(TimePoint now, Job job) {
    const Ticket ticket = job.ticket;
    const JobQueue::PushResult pushed = schedule_.backlog().queue().push(job);
    for (const Job& shed : pushed.shed) {
        outbox_.decide(now, Decision::Kind::shed, shed);
        // A read may have been sent, in a joined one that failed, and has changed nothing.
        const bool unsure = shed.attempts > 0 && !shed.request.is_read();
        outbox_.finish(shed, unsure ? Fault::timeout : Fault::busy);
    }
    if (pushed.taken) return ticket;
    outbox_.decide(now, Decision::Kind::full, job, {}, queue_depth());
    return Fault::busy;
}

void Desk::deny_waiting(const JobQueue::Test& match) {
    for (const Job& job : schedule_.backlog().queue().remove_if(match))
        outbox_.finish(job, Fault::denied);
    // What became of these nobody knows: they were sent.
    for (const Job& job : schedule_.backlog().remove_retries(match))
        outbox_.finish(job, Fault::timeout);
}

void Desk::cancel_waiting(Client client) {
    outbox_.on_client_gone(client);
    for (const Job& job : schedule_.backlog().cancel(client)) outbox_.finish(job, Fault::cancelled);
}

void Desk::expire_waiting(TimePoint now) {
    for (const Job& job : schedule_.backlog().expire(now)) {
        const bool sent = job.attempts > 0;
        outbox_.decide(now, sent ? Decision::Kind::unanswered : Decision::Kind::expired, job,
                       now - job.arrived);
        outbox_.finish(job, sent ? Fault::timeout : Fault::expired);
    }
    for (const Group& group : schedule_.backlog().take_dropped())
        give_up(now, group, group.silent ? Fault::timeout : Fault::damaged);
}

void Desk::clear_waiting() {
    for (const Job& job : schedule_.backlog().clear())
        outbox_.finish(job, job.attempts > 0 ? Fault::line_lost : Fault::line_down);
}

/// The station is asked: what it is known for decides about retries, and its silence is paid for.
void Desk::begin(TimePoint now, Group& group) {
    if (++group.attempts == 1) group.started = now;
    group.transaction = ++transactions_;
    for (Job& job : group.jobs) {
        job.transactions.add(group.transaction);
        if (job.attempts++ == 0) outbox_.on_started(now, job);
    }
    if (!group.request.is_read()) memory_.on_write(now, group.station, group.request);
    outbox_.written(group, false);
    if (group.station == kBroadcast) return;
    Station& station = stations_.of(group.station);
    if (group.attempts == 1) {
        group.repeatable = station.settings().retry_writes;
        group.was_online = station.answers_now(group.request.is_read());
    }
    station.on_asked(now, group);
    if (station.health().offline() && (group.probe || station.speculative()))
        stations_.on_probe(now, group.station);
}

void Desk::hand_on(Group& group, const Bytes& reply) {
    if (modbus::exception_of(reply)) {
        give_back(group);
    } else if (group.span && stations_.settings(group.station).max_age > Duration::zero()) {
        memory_.store({group.station, *group.span}, reply, group.started);
    }
    for (const Job& job : group.jobs)
        outbox_.finish(job, Sharing::part_for(group, reply, job), &job != &group.jobs.front());
}

void Desk::give_back(Group& group) {
    for (const Job& job : schedule_.give_back(group)) outbox_.finish(job, Fault::cancelled);
}

void Desk::give_up(TimePoint now, const Group& group, Fault fault) {
    for (const Job& job : group.jobs) outbox_.finish(job, fault);
    JobQueue& queue = schedule_.backlog().queue();
    if (group.learns_for != 0 && !was_heard(fault)) {
        // P8: the write never left, and its station is silent.
        const auto asked = [&](const Job& job) { return job.ticket == group.learns_for; };
        for (const Job& job : queue.remove_if(asked)) outbox_.finish(job, fault);
    }
    Station& station = stations_.of(group.station);
    const bool speculative = station.speculative();
    if (!station.on_given_up(now, fault, group.request.is_read())) return;
    if (!speculative) outbox_.event(StationEvent::Kind::offline, group.station);
    const auto theirs = [&](const Job& job) { return job.station == group.station; };
    for (const Job& job : queue.remove_if(theirs)) outbox_.finish(job, Fault::offline);
}

void Desk::explain_condition(TimePoint now, std::uint8_t station, Condition before) {
    const Condition is = stations_.condition(station);
    if (is != before && before != Condition::unheard)
        outbox_.decide(
            {.at = now, .kind = Decision::Kind::condition, .station = station, .condition = is});
}

}  // namespace panelgate::arbiter
