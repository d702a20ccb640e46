// How attempts end: jobs are answered, or the request is sent again, and the station is judged.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

TransactionEnd end_of(Verdict verdict) {
    if (verdict == Verdict::silent) return TransactionEnd::timeout;
    return verdict == Verdict::wrong ? TransactionEnd::wrong : TransactionEnd::damaged;
}

Fault fault_of(Verdict verdict) {
    if (verdict == Verdict::silent) return Fault::timeout;
    return verdict == Verdict::wrong ? Fault::wrong : Fault::damaged;
}

/// The last bit of a broadcast has left: no reply comes, the line rests for the turnaround.
void Arbiter::end_broadcast(TimePoint now) {
    Attempt attempt = take_active(now);
    quiet_.rest_until(attempt.timing().sent + settings_.broadcast_turnaround + latency_);
    stations_.on_broadcast(asked_of(attempt));
    outbox_.report(attempt, TransactionEnd::ok);
    // Their deadline passed unnoticed while it was leaving.
    for (const Job& job : attempt.group().expire(now)) outbox_.finish(job, Fault::timeout);
    for (const Job& job : attempt.group().jobs)
        outbox_.finish(job, modbus::normal_write_reply(job.request.pdu()));
}

/// The request of an attempt that has ended. `in_transit`: perhaps still held back (T8).
Asked Arbiter::asked_of(const Attempt& attempt, bool in_transit) const {
    const Group& group = attempt.group();
    const TimePoint sent = attempt.timing().sent;
    const Duration window = stations_.latest_reply(group.station);
    return {.by = attempt.is_broadcast() ? Asked::By::broadcast : Asked::By::us,
            .sent = sent,
            .until = in_transit ? Outstanding::kInTransit : sent + latency_ + window,
            .pdu = group.request.pdu(),
            .byte_count = group.request.byte_count(),
            .window = window};
}

/// The reply has come: it is handed on.
void Arbiter::settle(TimePoint now, const Bytes& reply) {
    Attempt attempt = take_active(now);
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    Outstanding& outstanding = stations_.outstanding();
    const Condition before = station.condition();
    const TimePoint sent = attempt.timing().sent;
    const TimePoint came = std::min(now, std::max(attempt.last_byte(), attempt.timing().started));
    const Duration needed = std::max(attempt.waited(reply.size() + modbus::kAduOverhead),
                                     std::max(attempt.first_byte() - sent, Duration{}));
    const bool refused = modbus::exception_of(reply).has_value();
    // The reply may be that to the first of several equal requests.
    const TimePoint answered = outstanding.sampled(now, group.station, group.request.pdu(), sent);
    group.started = std::min(group.started, answered);
    const Station::Replied replied = station.on_reply(came, attempt, refused, needed);
    const bool is_own = close_request(now, attempt, reply);
    outstanding.on_delivered(now, answered);
    stations_.on_reply(now, group.silent);
    if (replied.back) stations_.on_recovery();
    explain_condition(now, group.station, before);
    // The reply to a retry may be that to the attempt before: the retry may still be leaving.
    if (!settings_.paced && is_own && now < sent) quiet_.on_answered_early(now);
    replied_ = group.station;
    quiet_.trail_until(station.trail().until());
    outbox_.on_answered(now, attempt, reply, replied);
    if (attempt.is_clean() && teaches_echo(group.request)) echo_memory_.on_no_echo();
    outbox_.report(attempt, refused ? TransactionEnd::exception : TransactionEnd::ok);
    hand_on(group, reply);
}

/// Closes the request of an answered attempt, and what its station was asked before. Returns false
/// if the reply may be that to an earlier attempt: then this one is outstanding.
bool Arbiter::close_request(TimePoint now, const Attempt& attempt, const Bytes& reply) {
    const std::uint8_t id = attempt.group().station;
    const Station& station = stations_.of(id);
    // A transport that held the reply back may hold the next one; only a proof tells.
    Asked asked = asked_of(attempt, settings_.may_stall && station.reads().longer());
    if (asked.until != Outstanding::kInTransit)
        asked.until = std::max(asked.until, now + latency_ + station.latest_reply());
    return stations_.outstanding().on_reply(now, id, std::move(asked), reply);
}

void Arbiter::fail(TimePoint now, Verdict verdict) {
    Attempt attempt = take_active(now);
    outbox_.on_failed(attempt, verdict);
    outbox_.report(attempt, end_of(verdict));
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    const TimePoint sent = attempt.timing().sent;
    const Duration cost = now - attempt.timing().started + stations_.gap(group.station);
    const Condition before = station.condition();
    stations_.outstanding().add(group.station, asked_of(attempt, settings_.may_stall));
    station.on_failed(now, attempt, verdict, cost, settings_.learns_holes);
    stations_.on_failed(now, group.station, group.request.is_read(), cost);
    const bool affordable = stations_.affords_retry(now, station, verdict == Verdict::damaged);
    if (const auto until = schedule_.line_rests_until(now, group, sent, station)) {
        quiet_.quarantine(now, group.station, *until);
        outbox_.decide({.at = now,
                        .kind = Decision::Kind::line_rests,
                        .station = group.station,
                        .time = *until - now});
    }
    group.silent = verdict == Verdict::silent;
    if (group.silent) schedule_.on_silence(now);
    if (Station* const earlier = stations_.find(replied_before_);
        earlier != nullptr && attempt.heard() && verdict != Verdict::wrong)
        earlier->on_disturbed(attempt.timing().started);
    for (const Job& job : take_if(group.jobs, [](const Job& one) { return one.barred; }))
        outbox_.finish(job, job.gone ? Fault::cancelled : Fault::timeout);
    const std::uint8_t id = group.station;
    if (group.in_time(now) && affordable && station.may_retry(group)) {
        schedule_.retry(std::move(group));
    } else if (group.joined()) {
        give_back(group);  // health unaffected: the panel may only not answer this length (T14)
    } else {
        give_up(now, group, fault_of(verdict));
    }
    explain_condition(now, id, before);
    reopen_if_mute(now, attempt, verdict);
}

/// T8: a connection over which nothing is heard may be stalled. A new one is made after twice the
/// time each time: some device servers ignore the first seconds of a connection.
void Arbiter::reopen_if_mute(TimePoint now, const Attempt& attempt, Verdict verdict) {
    constexpr int kMute = 2;  // silent attempts in a row
    const bool mute = verdict == Verdict::silent && !attempt.heard();
    mute_.attempts = mute ? mute_.attempts + 1 : 0;
    if (!settings_.may_stall || !mute || now < mute_.next) return;
    if (mute_.ever_heard && mute_.attempts < kMute) return;
    mute_.pause =
        std::clamp<Duration>(2 * mute_.pause, timing::kSilentReopen, timing::kLongestReopen);
    mute_.next = now + mute_.pause;
    resetting_ = true;
    outbox_.reset("nothing was heard over the connection: what was sent may be held back");
}

/// Ends the attempt: accounts for its time, and passes on what the echo filter buffered.
Attempt Arbiter::take_active(TimePoint now) {
    Attempt attempt = std::move(*active_);
    active_.reset();
    const Duration behind = attempt.is_broadcast() ? settings_.broadcast_turnaround
                                                   : stations_.gap(attempt.group().station);
    outbox_.on_ended(now, attempt, behind);
    quiet_.take_rested(now);  // the attempt's own time
    outbox_.written(attempt.group(), true);
    if (attempt.echo().complete() && teaches_echo(attempt.group().request) &&
        echo_memory_.on_echo())
        outbox_.event(StationEvent::Kind::echo, attempt.group().station);
    if (attempt.heard()) mute_ = {.ever_heard = true};
    const Bytes pending = attempt.release_pending();
    idle_.insert(idle_.end(), pending.begin(), pending.end());
    return attempt;
}

}  // namespace panelgate::arbiter
