#include "panelgate/arbiter/outbox.hpp"
#include "panelgate/arbiter/book/timing.hpp"

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
    {Done::echo, FrameKind::echo, &Symptoms::echoes},
    {Done::request, FrameKind::foreign_request, &Symptoms::requests, true, true},
    {Done::damaged, FrameKind::damaged, &Symptoms::strays, true},
    {Done::duplicate, FrameKind::copy, &Symptoms::doubled},
    {Done::second, FrameKind::foreign, &Symptoms::doubled},  // of none that was heard
    {Done::late, FrameKind::late, &Symptoms::late},
    {Done::disorder, FrameKind::late, &Symptoms::late},
    {Done::broadcast, FrameKind::foreign, &Symptoms::broadcast_replies, false, true},
    {Done::unasked, FrameKind::foreign, &Symptoms::unasked, false, true},
    {Done::nobodys, FrameKind::foreign, &Symptoms::unasked, false, true},
};

/// A good frame that answers no request that is known to be open: a copy, or nobody's.
constexpr bool is_surplus(Done done) {
    return done == Done::duplicate || done == Done::second || done == Done::unasked ||
           done == Done::nobodys;
}

ByteView pdu_of(const modbus::Unused& frame) { return modbus::pdu_of(frame.bytes); }

/// True if there is one of the asked station.
bool holds_own(const std::vector<modbus::Unused>& frames) {
    return std::ranges::any_of(frames, [](const modbus::Unused& frame) {
        return frame.kind == modbus::Unused::Kind::own;
    });
}

FrameKind kind_of(const Group& group) {
    if (group.learns_for != 0 || !group.confirms.empty()) return FrameKind::learn_echo;
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
    completed_ = false;
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
    Finish answer;
    answer.ticket = ticket;
    answer.pdu = std::move(pdu);
    answer.age = age;
    actions_.push_back(std::move(answer));
}

void Outbox::report(const Attempt& attempt, TransactionEnd end) {
    if (!explain_) return;
    const Group& group = attempt.group();
    const Attempt::Timing& timing = attempt.timing();
    Exchange exchange;
    exchange.transaction = group.transaction;
    exchange.end = end;
    exchange.station = group.station;
    if (!group.jobs.empty()) exchange.arrived = group.jobs.front().arrived;
    exchange.granted = timing.started;
    exchange.first_bit_out = timing.sent - timing.leaving;
    exchange.last_bit_out = timing.sent;
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
                            std::uint8_t asked, Duration lateness) {
    const Shown& shown = *std::ranges::find(kShown, done, &Shown::done);
    const bool late = is_late(done);
    of(is_reply(done) ? part.station : asked).discarded_bytes += part.bytes.size();
    if (late) ++of(part.station).late_frames;
    if (shown.foreign) ++of(asked).foreign_frames;
    Symptoms& symptoms = symptoms_of(shown.counts_for_asked ? asked : part.station);
    if (late) symptoms.mute_in_a_row = 0;
    symptoms.worst_lateness = std::max(symptoms.worst_lateness, lateness);
    const bool in_time = late && lateness <= Duration::zero();  // after a shortened wait
    // A copy of a write's reply, which is its request, is no echo.
    const bool unsure = done == Done::echo && modbus::answers(pdu_of(part), pdu_of(part));
    const bool elsewhere = unsure || (done == Done::damaged && inside_attempt_);
    const bool old = is_surplus(done) && before_.is_old_reply(part.station, pdu_of(part));
    if (!in_time && !elsewhere) ++(symptoms.*(old ? &Symptoms::old_replies : shown.symptom));
    if (done == Done::damaged) {
        join(part.bytes, asked);
    } else if (const Bytes begun = std::exchange(cut_, {});
               !begun.empty() && std::ranges::mismatch(begun, part.bytes).in1 == begun.end()) {
        ++symptoms_of(cut_for_).torn;  // it was no damage
    }
    refused_late_ = refused_late_ || (inside_attempt_ && part.station == asked && is_late(done) &&
                                      modbus::exception_of(pdu_of(part)));
    if (inside_attempt_ && is_surplus(done) && !old && part.station != asked)
        other_frame_.assign(pdu_of(part).begin(), pdu_of(part).end());
    actions_.push_back(Note{now, shown.kind, part.bytes, {}});
}

// Symptoms, for diagnosis only: nothing depends on them.

/// Our own request may cut a frame that comes meanwhile in two: no damage, where both pieces are
/// one good frame.
void Outbox::join(ByteView bytes, std::uint8_t asked) {
    Bytes whole = std::exchange(cut_, {});
    const bool first = whole.empty();
    whole.insert(whole.end(), bytes.begin(), bytes.end());
    if (!first && !frames_in(whole, asked).empty()) {
        ++symptoms_of(cut_for_).torn;
        if (!inside_attempt_) ++symptoms_of(asked).torn;
        completed_ = inside_attempt_;
    } else if (!inside_attempt_ && whole.size() <= modbus::kMaxRtuAdu) {
        cut_ = std::move(whole);
        cut_for_ = asked;
    }
}

/// Returns the frames, if there is nothing else: good ones, in whatever pieces they came.
std::vector<modbus::Unused> Outbox::frames_in(ByteView bytes, std::uint8_t asked) const {
    std::vector<modbus::Unused> parts = modbus::classify_heard(bytes, asked, orders_);
    const auto damaged = [](const modbus::Unused& part) {
        return part.kind == modbus::Unused::Kind::damaged;
    };
    if (std::ranges::any_of(parts, damaged)) parts.clear();
    return parts;
}

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

/// False where the normal reply equals the request: what came back may have been that.
bool is_surely_echoed(const Attempt& attempt) {
    const modbus::Request& request = attempt.group().request;
    return attempt.echoed() && (teaches_echo(request) || teaches_echo_of_writes(request));
}

}  // namespace

void Outbox::on_answered(TimePoint now, const Attempt& attempt, Duration think,
                         const Station::Replied& replied) {
    const std::uint8_t station = attempt.group().station;
    note_reply(now, station, attempt.reply());
    StationCounters& counters = of(station);
    Symptoms& symptoms = counters.symptoms;
    counters.turnaround.observe(think);
    counters.bus_transaction.observe(now - attempt.timing().started);
    if (const auto code = modbus::exception_of(attempt.reply())) ++counters.exceptions[*code];
    ++(attempt.echo().mismatch() ? symptoms.collided : symptoms.answered);
    ++symptoms.answered_after[pause_class(attempt.timing().pause)];
    if (attempt.reply().size() + modbus::kAduOverhead >= Symptoms::kLongReply)
        ++symptoms.long_answered;
    if (is_surely_echoed(attempt)) ++symptoms.echoes;
    count_beside(attempt);
    if (symptoms.mute_in_a_row > 0) ++symptoms.silences;
    if (before_.on_answered(station, attempt.group().request.pdu(), attempt.reply()))
        ++symptoms.repeated;
    if (replied.trailed) ++symptoms.trailed;
    credit_unanswered(attempt.group());
    if (replied.back) event(StationEvent::Kind::online, station);
    if (replied.drift) event(StationEvent::Kind::drift, station, *replied.drift);
    if (replied.trail) event(StationEvent::Kind::trail, station, *replied.trail);
    symptoms.mute_in_a_row = 0;
}

/// Counts what came beside the reply.
void Outbox::count_beside(const Attempt& attempt) {
    const std::uint8_t station = attempt.group().station;
    const ByteView bytes = attempt.damaged_bytes();
    if (bytes.empty()) return;
    if (!completed_) join(bytes, station);
    if (completed_) return;
    const std::vector<modbus::Unused> frames = frames_in(bytes, station);
    if (frames.empty()) ++symptoms_of(station).strays;
    for (const modbus::Unused& frame : frames) ++symptoms_of(frame.station).unasked;
}

void Outbox::on_doubted(TimePoint now, const Attempt& attempt) {
    note_reply(now, attempt.group().station, attempt.group().doubted);
}

void Outbox::note_reply(TimePoint now, std::uint8_t station, const Bytes& pdu) {
    actions_.push_back(
        Note{now, FrameKind::reply, modbus::encode_adu(station, pdu, orders_.of(station)), {}});
}

void Outbox::on_failed(const Attempt& attempt, Verdict verdict) {
    Symptoms& symptoms = symptoms_of(attempt.group().station);
    const bool damaged = !attempt.damaged_bytes().empty() && !completed_;
    const std::vector<modbus::Unused> frames =
        damaged ? frames_in(attempt.damaged_bytes(), attempt.group().station)
                : std::vector<modbus::Unused>{};
    if (is_surely_echoed(attempt)) ++symptoms.echoes;
    if (verdict == Verdict::damaged) ++of(attempt.group().station).damaged_frames;
    if (verdict != Verdict::silent) symptoms.mute_in_a_row = 0;
    if (attempt.echo().mismatch()) {
        ++symptoms.collided;
        symptoms.mute_in_a_row = 0;
    } else if ((verdict == Verdict::wrong && !refused_late_) || holds_own(frames)) {
        ++symptoms.wrong;
        if (attempt.refused_other()) ++symptoms.wrong_exceptions;
    } else if (damaged && frames.empty()) {
        count_damaged(attempt);
        symptoms.mute_in_a_row = 0;
    } else {
        const bool silent = !attempt.heard() && !attempt.disturbed();
        ++(silent ? symptoms.silent : symptoms.disturbed);
        if (silent) remember_unanswered(attempt, symptoms.mute_in_a_row);
        if (is_answered_by_other(attempt, frames)) ++symptoms.misaddressed;
        if (!is_search(attempt.group())) ++symptoms.mute_in_a_row;
    }
}

/// True if a frame with another station's address would have been the answer.
bool Outbox::is_answered_by_other(const Attempt& attempt,
                                  const std::vector<modbus::Unused>& frames) const {
    const ByteView request = attempt.group().request.pdu();
    const ByteView pdu = frames.empty() ? ByteView(other_frame_) : pdu_of(frames.front());
    return !pdu.empty() && modbus::answers(request, pdu);
}

/// An unanswered read that is answered when asked again gives evidence about the pause before it.
/// An offline station gives none, nor does a register that the panel ignores.
void Outbox::remember_unanswered(const Attempt& attempt, std::uint64_t mute_before) {
    const Group& group = attempt.group();
    constexpr std::uint64_t kMost = 2;  // in a row: a retry may follow another frame closely, too
    if (!group.request.is_read()) return;
    if (!is_search(group)) before_.on_unanswered(group.station, group.request.pdu());
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
    // A good frame except for the order of the CRC's bytes.
    if (modbus::crc_ok(bytes, other(orders_.of(group.station)))) ++symptoms.crc_swapped;
    if (modbus::ends_in_lower_case(bytes)) ++symptoms.lower_case;
    if (head) ++symptoms.damaged_heads;
    if (attempt.lost_beginning()) ++symptoms.beheaded;
    if (expected.value_or(bytes.size()) >= Symptoms::kLongReply) ++symptoms.long_damaged;
    symptoms.damaged_bytes += bytes.size();
    symptoms.damaged_odd += static_cast<std::uint64_t>(
        std::ranges::count_if(bytes, [](std::uint8_t b) { return std::popcount(b) % 2 == 1; }));
    symptoms.damaged_zeros += static_cast<std::uint64_t>(std::ranges::count(bytes, 0));
}

}  // namespace panelgate::arbiter
