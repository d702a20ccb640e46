#include "panelgate/arbiter/ledger.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

namespace {

FrameKind kind_of(Ledger::Part what) {
    switch (what) {
        case Ledger::Part::damaged:
            return FrameKind::damaged;
        case Ledger::Part::echo:
            return FrameKind::echo;
        case Ledger::Part::request:
            return FrameKind::foreign_request;
        case Ledger::Part::late:
            return FrameKind::late;
        case Ledger::Part::copy:
            return FrameKind::copy;
        case Ledger::Part::broadcast_reply:
        case Ledger::Part::unasked:
        case Ledger::Part::unknown:
            return FrameKind::foreign;
    }
    std::abort();
}

FrameKind kind_of(const Group& group) {
    if (group.learns_for != 0 || !group.confirms.empty()) return FrameKind::learn_echo;
    if (group.station == kBroadcast) return FrameKind::broadcast;
    if (group.probe) return FrameKind::probe;
    return group.attempts > 1 ? FrameKind::retry : FrameKind::request;
}

}  // namespace

Ledger::Ledger(const Settings& settings) { apply(settings); }

void Ledger::apply(const Settings& settings) {
    explain_ = settings.explain;
    orders_ = crc_orders(settings);
    std::map<std::uint8_t, StationCounters> before = std::exchange(stations_, {});
    stations_[kUnlisted] = std::move(before[kUnlisted]);
    for (const StationSettings& station : settings.stations)
        stations_[station.id] = std::move(before[station.id]);
}

std::optional<Action> Ledger::poll() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
}

StationCounters& Ledger::of(std::uint8_t station) {
    const auto found = stations_.find(station);
    return found == stations_.end() ? stations_[kUnlisted] : found->second;
}

void Ledger::transmit(TimePoint now, const Attempt& attempt, Bytes adu, Bytes wire, Reason why) {
    const Group& group = attempt.group();
    if (group.attempts > 1) ++of(group.station).retries;
    if (group.station == kBroadcast) ++line_.broadcasts;
    actions_.push_back(
        Note{now, kind_of(group), std::move(adu), std::move(why), group.transaction});
    actions_.push_back(Transmit{std::move(wire)});
}

void Ledger::finish(const Job& job, Result<Bytes> pdu, bool shared) {
    actions_.push_back(
        Finish{job.ticket, std::move(pdu), job.attempts > 0, shared, {}, job.transactions});
}

void Ledger::finish_from_memory(Ticket ticket, Bytes pdu, Duration age) {
    Finish answer;
    answer.ticket = ticket;
    answer.pdu = std::move(pdu);
    answer.age = age;
    actions_.push_back(std::move(answer));
}

void Ledger::tell(const Attempt& attempt, TransactionEnd end) {
    if (!explain_) return;
    const Group& group = attempt.group();
    const Attempt::Timing& timing = attempt.timing();
    Exchange told;
    told.transaction = group.transaction;
    told.end = end;
    told.station = group.station;
    if (!group.jobs.empty()) told.arrived = group.jobs.front().arrived;
    told.granted = timing.started;
    told.first_bit_out = timing.sent - timing.leaving;
    told.last_bit_out = timing.sent;
    if (attempt.heard()) {
        told.first_byte_in = attempt.first_byte();
        told.last_byte_in = attempt.last_byte();
    }
    actions_.push_back(told);
}

void Ledger::event(StationEvent::Kind kind, std::uint8_t station, Duration by) {
    actions_.push_back(StationEvent{kind, station, by});
}

void Ledger::written(const Group& group, bool ended) {
    if (group.request.is_read()) return;
    const Client client = group.jobs.empty() ? 0 : group.jobs.front().client;
    actions_.push_back(Written{group.station, group.request.access().write, ended, client});
}

void Ledger::on_started(TimePoint now, const Job& job) {
    line_.queue_wait[static_cast<std::size_t>(job.priority)].observe(now - job.arrived);
}

void Ledger::on_ended(TimePoint now, const Attempt& attempt, Duration gap) {
    const Attempt::Timing& timing = attempt.timing();
    const TimePoint longest = attempt.give_up() + timing.longest_reply;
    const TimePoint end = std::max({timing.sent, attempt.last_byte(), std::min(now, longest)});
    const Duration busy = end - timing.started + gap;
    line_.busy += busy;
    const Jobs& jobs = attempt.group().jobs;
    for (const Job& job : jobs) {
        if (!job.gone) shares_.add(job.client, busy / static_cast<int>(jobs.size()));
    }
}

void Ledger::on_echo_mismatch(TimePoint now, std::uint8_t station) {
    constexpr Duration kPause = 10s;
    ++of(station).echo_mismatches;
    if (told_collision_ && now < *told_collision_ + kPause) return;
    told_collision_ = now;
    event(StationEvent::Kind::collision, station);
}

void Ledger::on_stray(TimePoint now, const modbus::Unused& part, Part what, std::uint8_t asked,
                      Duration lateness) {
    const bool known = what == Part::late || what == Part::copy || what == Part::unasked;
    const bool nobodys = what == Part::unasked || what == Part::unknown || what == Part::request ||
                         what == Part::broadcast_reply;
    of(known ? part.station : asked).discarded_bytes += part.bytes.size();
    if (what == Part::late) ++of(part.station).late_frames;
    if (nobodys) ++of(asked).foreign_frames;
    count_stray(part, what, asked, lateness);
    actions_.push_back(Note{now, kind_of(what), part.bytes, {}});
}

// What tells a line's troubles apart. Everything here is counted and nothing depends on it.

namespace {

/// Symptoms::kPauses classes: below 2 ms, 4 ms, 8 ms …
std::size_t pause_class(Duration pause) {
    std::size_t i = 0;
    for (Duration bound = 2ms; i + 1 < Symptoms::kPauses && pause >= bound; bound *= 2) ++i;
    return i;
}

/// Of addresses that a search asks nobody knows whether anybody is there.
bool is_search(const Group& group) {
    return !group.jobs.empty() && std::ranges::all_of(group.jobs, &Job::search);
}

}  // namespace

void Ledger::on_answered(TimePoint now, const Attempt& attempt, Duration think,
                         const Station::Replied& replied) {
    const std::uint8_t station = attempt.group().station;
    actions_.push_back(Note{now,
                            FrameKind::reply,
                            modbus::encode_adu(station, attempt.reply(), orders_.of(station)),
                            {}});
    StationCounters& counters = of(station);
    Symptoms& symptoms = counters.symptoms;
    counters.turnaround.observe(think);
    counters.bus_transaction.observe(now - attempt.timing().started);
    if (const auto code = modbus::exception_of(attempt.reply())) ++counters.exceptions[*code];
    ++(attempt.echo().mismatch() ? symptoms.collided : symptoms.answered);
    ++symptoms.answered_after[pause_class(attempt.timing().pause)];
    if (attempt.reply().size() + modbus::kAduOverhead >= Symptoms::kLongReply)
        ++symptoms.long_answered;
    if (attempt.echoed()) ++symptoms.echoes;
    if (!attempt.damaged_bytes().empty()) ++symptoms.strays;
    if (replied.trailed) ++symptoms.trailed;
    credit_unheard(attempt.group());
    if (replied.back) event(StationEvent::Kind::online, station);
    if (replied.drift) event(StationEvent::Kind::drift, station, *replied.drift);
    if (replied.trail) event(StationEvent::Kind::trail, station, *replied.trail);
    symptoms.mute_in_a_row = 0;
}

void Ledger::on_failed(const Attempt& attempt, Verdict verdict) {
    Symptoms& symptoms = symptoms_of(attempt.group().station);
    if (attempt.echoed()) ++symptoms.echoes;
    if (verdict == Verdict::damaged) ++of(attempt.group().station).damaged_frames;
    if (verdict != Verdict::silent) symptoms.mute_in_a_row = 0;
    if (attempt.echo().mismatch()) {
        ++symptoms.collided;
        symptoms.mute_in_a_row = 0;
    } else if (verdict == Verdict::wrong) {
        ++symptoms.wrong;
        if (attempt.refused_other()) ++symptoms.wrong_exceptions;
    } else if (!attempt.damaged_bytes().empty()) {
        count_damaged(attempt);
        symptoms.mute_in_a_row = 0;
    } else {
        const bool silent = !attempt.heard() && !attempt.disturbed();
        ++(silent ? symptoms.silent : symptoms.disturbed);
        if (silent) remember_unheard(attempt, symptoms.mute_in_a_row);
        if (!is_search(attempt.group())) ++symptoms.mute_in_a_row;
    }
}

/// A read that stays without reply now, and is answered when it is asked again, tells about the
/// pause before it. A station that is off tells nothing, nor does a register that it ignores.
void Ledger::remember_unheard(const Attempt& attempt, std::uint64_t mute_before) {
    const Group& group = attempt.group();
    constexpr std::uint64_t kMost = 2;  // in a row: a retry may follow another frame closely, too
    if (!group.request.is_read()) return;
    if (mute_before >= kMost) {
        unheard_.erase(group.station);
        return;
    }
    Unheard& unheard = unheard_[group.station];
    if (unheard.pdu != group.request.pdu()) unheard = {group.request.pdu(), {}, 0};
    if (unheard.count < unheard.pauses.size())
        unheard.pauses[unheard.count++] = pause_class(attempt.timing().pause);
}

void Ledger::credit_unheard(const Group& group) {
    const auto found = unheard_.find(group.station);
    if (found == unheard_.end() || found->second.pdu != group.request.pdu()) return;
    const Unheard& unheard = found->second;
    for (std::size_t i = 0; i < unheard.count; ++i)
        ++symptoms_of(group.station).silent_after[unheard.pauses[i]];
    unheard_.erase(found);
}

/// Its own line in the account of an attempt: what came instead of the reply.
void Ledger::count_damaged(const Attempt& attempt) {
    const Group& group = attempt.group();
    const ByteView bytes = attempt.damaged_bytes();
    Symptoms& symptoms = symptoms_of(group.station);
    const auto expected = group.request.reply_length();
    const bool head = bytes.size() >= 2 && bytes[0] == group.station &&
                      modbus::plain_function(bytes[1]) == group.request.function();
    if (expected && bytes.size() == *expected) {
        ++symptoms.damaged_exact;
    } else if (expected && bytes.size() < *expected) {
        ++symptoms.damaged_short;
    } else {
        ++symptoms.damaged_long;
    }
    // A good frame, but for the order of the CRC's bytes.
    if (modbus::crc_ok(bytes, other(orders_.of(group.station)))) ++symptoms.crc_swapped;
    if (modbus::ends_in_lower_case(bytes)) ++symptoms.lower_case;
    if (head) ++symptoms.damaged_heads;
    if (expected.value_or(bytes.size()) >= Symptoms::kLongReply) ++symptoms.long_damaged;
    symptoms.damaged_bytes += bytes.size();
    symptoms.damaged_odd += static_cast<std::uint64_t>(
        std::ranges::count_if(bytes, [](std::uint8_t b) { return std::popcount(b) % 2 == 1; }));
    symptoms.damaged_zeros += static_cast<std::uint64_t>(std::ranges::count(bytes, 0));
}

void Ledger::count_stray(const modbus::Unused& part, Part what, std::uint8_t asked,
                         Duration lateness) {
    const bool known = what != Part::damaged && what != Part::unknown && what != Part::request;
    Symptoms& symptoms = symptoms_of(known ? part.station : asked);
    switch (what) {
        case Part::damaged:
            if (!inside_attempt_) ++symptoms.strays;
            return;
        case Part::echo:
            ++symptoms.echoes;
            return;
        case Part::request:
            ++symptoms.requests;
            return;
        case Part::late:
            symptoms.mute_in_a_row = 0;
            if (lateness <= Duration::zero()) return;  // behind a wait that was cut short
            ++symptoms.late;
            symptoms.worst_lateness = std::max(symptoms.worst_lateness, lateness);
            return;
        case Part::copy:
            ++symptoms.doubled;
            return;
        case Part::broadcast_reply:
            ++symptoms.broadcast_replies;
            return;
        case Part::unasked:
        case Part::unknown:
            ++symptoms.unasked;
            return;
    }
}

}  // namespace panelgate::arbiter
