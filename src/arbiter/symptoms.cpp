// What tells a line's troubles apart. Everything here is counted and nothing depends on it.

#include <algorithm>
#include <bit>
#include <utility>

#include "panelgate/arbiter/ledger.hpp"
#include "panelgate/modbus/ascii_frame.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

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
