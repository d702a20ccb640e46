#include "panelgate/arbiter/outbox.hpp"
#include "panelgate/arbiter/timing.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

namespace {

constexpr std::uint8_t kUnlisted = 0;  // key of the counters

/// How a frame is shown and counted that answers no open request.
struct Shown {
    Done done;
    FrameKind kind;
    std::uint64_t Symptoms::* symptom;
    bool counts_for_asked = false;  ///< it names no station, or not its sender
    bool foreign = false;
};
constexpr Shown kShown[] = {
    {Done::contested, FrameKind::foreign, &Symptoms::unasked, false, true},
    {Done::echo, FrameKind::echo, &Symptoms::echoes},
    {Done::request, FrameKind::foreign_request, &Symptoms::requests, true, true},
    {Done::damaged, FrameKind::damaged, &Symptoms::strays, true},
    {Done::copy, FrameKind::copy, &Symptoms::doubled},
    {Done::second, FrameKind::foreign, &Symptoms::doubled},  // of none that was heard
    {Done::late, FrameKind::late, &Symptoms::late},
    {Done::broadcast, FrameKind::foreign, &Symptoms::broadcast_replies, false, true},
    {Done::wrong, FrameKind::foreign, &Symptoms::unasked, false, true},
    {Done::nobodys, FrameKind::foreign, &Symptoms::unasked, false, true},
};

ByteView pdu_of(const modbus::Unused& frame) { return modbus::pdu_of(frame.bytes); }

FrameKind kind_of(const Group& group) {
    if (group.learns_for != 0) return FrameKind::learn_echo;
    if (group.station == kBroadcast) return FrameKind::broadcast;
    if (group.probe) return FrameKind::probe;
    return group.attempts > 1 ? FrameKind::retry : FrameKind::request;
}

}  // namespace

Outbox::Outbox(const Settings& settings) { apply(settings); }

void Outbox::apply(const Settings& settings) {
    explain_ = settings.explain;
    orders_ = crc_orders(settings);
    std::map<std::uint8_t, StationCounters> before = std::exchange(stations_, {});
    stations_[kUnlisted] = std::move(before[kUnlisted]);
    for (const StationSettings& station : settings.stations)
        stations_[station.id] = std::move(before[station.id]);
}

std::optional<Action> Outbox::poll() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
}

StationCounters& Outbox::of(std::uint8_t station) {
    const auto found = stations_.find(station);
    return found == stations_.end() ? stations_[kUnlisted] : found->second;
}

void Outbox::transmit(TimePoint now, const Attempt& attempt, Bytes adu, Bytes wire,
                      const Reason& why) {
    const Group& group = attempt.group();
    other_frame_.clear();
    if (group.attempts > 1) ++of(group.station).retries;
    if (group.station == kBroadcast) ++line_.broadcasts;
    actions_.push_back(
        Note{now, kind_of(group), std::move(adu), explain_ ? why : Reason{}, group.transaction});
    actions_.push_back(Transmit{std::move(wire)});
}

void Outbox::finish(const Job& job, Result<Bytes> pdu, bool shared) {
    actions_.push_back(
        Finish{job.ticket, std::move(pdu), job.attempts > 0, shared, {}, job.transactions});
}

void Outbox::finish_from_memory(Ticket ticket, Bytes pdu, Duration age) {
    actions_.push_back(Finish{.ticket = ticket, .pdu = std::move(pdu), .age = age});
}

void Outbox::report(const Attempt& attempt, TransactionEnd end) {
    if (!explain_) return;
    const Group& group = attempt.group();
    const Attempt::Timing& timing = attempt.timing();
    Exchange exchange{{}, group.transaction, end, group.station};
    exchange.granted = timing.started;
    exchange.first_bit_out = timing.sent - timing.leaving;
    exchange.last_bit_out = timing.sent;
    if (!group.jobs.empty()) exchange.arrived = group.jobs.front().arrived;
    if (attempt.heard()) {
        exchange.first_byte_in = attempt.first_byte();
        exchange.last_byte_in = attempt.last_byte();
    }
    actions_.push_back(exchange);
}

void Outbox::event(StationEvent::Kind kind, std::uint8_t station, Duration by) {
    actions_.push_back(StationEvent{kind, station, by});
}

void Outbox::written(const Group& group, bool ended) {
    if (group.request.is_read()) return;
    const Client client = group.jobs.empty() ? 0 : group.jobs.front().client;
    actions_.push_back(Written{group.station, group.request.access().write, ended, client});
}

void Outbox::on_started(TimePoint now, const Job& job) {
    line_.queue_wait[static_cast<std::size_t>(job.priority)].observe(now - job.arrived);
}

void Outbox::on_ended(TimePoint now, const Attempt& attempt, Duration gap) {
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

void Outbox::on_echo_mismatch(TimePoint now, std::uint8_t station) {
    ++of(station).echo_mismatches;
    if (reported_collision_ && now < *reported_collision_ + timing::kReportsCollision) return;
    reported_collision_ = now;
    event(StationEvent::Kind::collision, station);
}

void Outbox::on_unsolicited(TimePoint now, const modbus::Unused& part, Done done,
                            std::uint8_t asked, bool inside, Duration lateness) {
    const Shown& shown = *std::ranges::find(kShown, done, &Shown::done);
    const bool late = done == Done::late;
    of(is_reply(done) ? part.station : asked).discarded_bytes += part.bytes.size();
    if (late) ++of(part.station).late_frames;
    if (shown.foreign) ++of(asked).foreign_frames;
    Symptoms& symptoms = symptoms_of(shown.counts_for_asked ? asked : part.station);
    if (late) symptoms.mute_in_a_row = 0;
    symptoms.worst_lateness = std::max(symptoms.worst_lateness, lateness);
    // A reply to the first of two attempts is no late one.
    const bool in_time = late && lateness <= Duration::zero();
    // A copy of a write's reply, which is its request, is no echo.
    const bool unsure = done == Done::echo && modbus::answers(pdu_of(part), pdu_of(part));
    const bool counted_at_end = inside && (done == Done::damaged || done == Done::echo);
    const bool elsewhere = unsure || counted_at_end;
    if (!in_time && !elsewhere) ++(symptoms.*shown.symptom);
    const bool answers_none = done == Done::nobodys || done == Done::wrong || done == Done::second;
    if (inside && answers_none && part.station != asked)
        other_frame_.assign(pdu_of(part).begin(), pdu_of(part).end());
    actions_.push_back(Note{now, shown.kind, part.bytes, {}});
}

// Symptoms, for diagnosis only: nothing depends on them.

namespace {

/// Symptoms::kPauses classes: below 2 ms, 4 ms, 8 ms …
std::size_t pause_class(Duration pause) {
    std::size_t i = 0;
    for (Duration bound = 2ms; i + 1 < Symptoms::kPauses && pause >= bound; bound *= 2) ++i;
    return i;
}

/// A scan may ask addresses without a panel.
bool is_search(const Group& group) {
    return !group.jobs.empty() && std::ranges::all_of(group.jobs, &Job::search);
}

}  // namespace

void Outbox::on_answered(TimePoint now, const Attempt& attempt, ByteView reply,
                         const Station::Replied& replied) {
    const Group& group = attempt.group();
    const std::uint8_t station = group.station;
    actions_.push_back(
        Note{now, FrameKind::reply, modbus::encode_adu(station, reply, orders_.of(station)), {}});
    const std::size_t size = reply.size() + modbus::kAduOverhead;
    StationCounters& counters = of(station);
    Symptoms& symptoms = counters.symptoms;
    const Duration silence = silent_interval(attempt.timing().serial);
    counters.turnaround.observe(std::max(attempt.waited(size) - silence, Duration{}));
    counters.bus_transaction.observe(now - attempt.timing().started);
    if (const auto code = modbus::exception_of(reply)) ++counters.exceptions[*code];
    ++(attempt.echo().mismatch() ? symptoms.collided : symptoms.answered);
    ++symptoms.answered_after[pause_class(attempt.timing().pause)];
    if (size >= Symptoms::kLongReply) ++symptoms.long_answered;
    if (attempt.echo().complete()) ++symptoms.echoes;
    if (!attempt.damaged_bytes().empty()) ++symptoms.strays;
    if (symptoms.mute_in_a_row > 0) ++symptoms.silences;
    if (replied.trailed) ++symptoms.trailed;
    credit_unanswered(group);
    if (replied.back) event(StationEvent::Kind::online, station);
    if (replied.drift) event(StationEvent::Kind::drift, station, *replied.drift);
    if (replied.trail) event(StationEvent::Kind::trail, station, *replied.trail);
    symptoms.mute_in_a_row = 0;
}

void Outbox::on_failed(const Attempt& attempt, Verdict verdict) {
    const Group& group = attempt.group();
    Symptoms& symptoms = symptoms_of(group.station);
    if (attempt.echo().complete() && teaches_echo(group.request)) ++symptoms.echoes;
    if (verdict == Verdict::damaged) ++of(group.station).damaged_frames;
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
        if (silent) remember_unanswered(attempt, symptoms.mute_in_a_row);
        // A frame with another station's address would have been the answer.
        if (!other_frame_.empty() && modbus::answers(group.request.pdu(), other_frame_))
            ++symptoms.misaddressed;
        if (!is_search(group)) ++symptoms.mute_in_a_row;
    }
}

/// An unanswered read that is answered when asked again gives evidence about the pause before it.
/// An offline station gives none, nor does a register that the panel ignores.
void Outbox::remember_unanswered(const Attempt& attempt, std::uint64_t mute_before) {
    const Group& group = attempt.group();
    constexpr std::uint64_t kMost = 2;  // in a row: a retry may follow another frame closely, too
    if (!group.request.is_read()) return;
    if (mute_before >= kMost) {
        unanswered_.erase(group.station);
        return;
    }
    Unanswered& unanswered = unanswered_[group.station];
    if (unanswered.pdu != group.request.pdu()) unanswered = {group.request.pdu(), {}, 0};
    if (unanswered.count < unanswered.pauses.size())
        unanswered.pauses[unanswered.count++] = pause_class(attempt.timing().pause);
}

void Outbox::credit_unanswered(const Group& group) {
    const auto found = unanswered_.find(group.station);
    if (found == unanswered_.end() || found->second.pdu != group.request.pdu()) return;
    const Unanswered& unanswered = found->second;
    ++symptoms_of(group.station).repeated;
    for (std::size_t i = 0; i < unanswered.count; ++i)
        ++symptoms_of(group.station).silent_after[unanswered.pauses[i]];
    unanswered_.erase(found);
}

/// Counts an attempt with damage instead of the reply.
void Outbox::count_damaged(const Attempt& attempt) {
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
    if (modbus::crc_ok(bytes, other(orders_.of(group.station)))) ++symptoms.crc_swapped;
    if (modbus::ends_in_lower_case(bytes)) ++symptoms.lower_case;
    if (modbus::has_other_delimiters(bytes, expected.value_or(0))) ++symptoms.delimited;
    if (head) ++symptoms.damaged_heads;
    if (attempt.lost_beginning()) ++symptoms.beheaded;
    if (expected.value_or(bytes.size()) >= Symptoms::kLongReply) ++symptoms.long_damaged;
    symptoms.damaged_bytes += bytes.size();
    symptoms.damaged_odd += static_cast<std::uint64_t>(
        std::ranges::count_if(bytes, [](std::uint8_t b) { return std::popcount(b) % 2 == 1; }));
    symptoms.damaged_zeros += static_cast<std::uint64_t>(std::ranges::count(bytes, 0));
}

}  // namespace panelgate::arbiter
