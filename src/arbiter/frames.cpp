// Frames: facts are gathered, the table decides, the decision is carried out.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

using fact::when;
using modbus::Unused;

namespace {

/// True for a good frame that can only be another master's request.
bool is_request(ByteView adu) {
    const modbus::ReplyLength as_reply = modbus::reply_length(adu);
    const bool fits_reply =
        as_reply.kind == modbus::ReplyLength::Kind::known && as_reply.length == adu.size();
    return !fits_reply && modbus::request_adu_length(adu) == adu.size();
}

/// True for our own frame, also without a last byte of 0, for the CRC is good all the same.
bool is_own(ByteView adu, ByteView own) {
    return std::ranges::equal(adu, own) ||
           (adu.size() + 1 == own.size() && std::ranges::equal(adu, own.first(adu.size())));
}

bool is_refusal(ByteView pdu) { return modbus::exception_of(pdu).has_value(); }

}  // namespace

/// Judges each frame that the attempt has heard. The answer ends the attempt.
void Arbiter::conclude(TimePoint now) {
    if (active_->heard()) mute_.ever_heard = true;
    for (const Attempt::Heard& heard : active_->take_heard())
        judge_part(now, heard.part, heard.answers && active_.has_value());
    if (!active_) return;
    if (const Verdict verdict = active_->verdict(now); verdict != Verdict::open) fail(now, verdict);
}

void Arbiter::judge_part(TimePoint now, const Unused& part, bool answers) {
    const ByteView own = last_frame_;
    if (part.kind == Unused::Kind::damaged && part.bytes.size() > own.size() && !own.empty() &&
        std::ranges::equal(ByteView(part.bytes).first(own.size()), own)) {
        // Our echo may be as late as the reply behind it (T6, T8).
        judge_part(now, modbus::classify_frame(own, quiet_.station(), true), false);
        const ByteView behind = ByteView(part.bytes).subspan(own.size());
        for (const Unused& other : modbus::classify_heard(behind, quiet_.station(), orders_))
            judge_part(now, other, false);
        return;
    }
    const Done done = judge(facts_of(now, part, answers));
    if (done == Done::accept) {
        const ByteView pdu = modbus::pdu_of(part.bytes);
        return settle(now, Bytes(pdu.begin(), pdu.end()));
    }
    const bool inside = active_ && !active_->is_broadcast();
    const Duration lateness = carry_out(now, part, done);
    outbox_.on_unsolicited(now, part, done, quiet_.station(), inside, lateness);
}

Facts Arbiter::facts_of(TimePoint now, const Unused& part, bool answers) const {
    const ByteView adu = part.bytes;
    const bool damaged = part.kind == Unused::Kind::damaged;
    const bool begins = begins_with_request(adu, last_frame_, orders_);
    const Facts facts =
        when(answers, fact::answers) | when(is_own(adu, last_frame_), fact::own_frame) |
        when(begins && (damaged || is_request(adu)), fact::request) | when(damaged, fact::damaged);
    if (damaged) return facts;
    const std::uint8_t id = adu[0];
    const ByteView pdu = modbus::pdu_of(adu);
    const Outstanding& asked = stations_.outstanding();
    const Station* const station = stations_.find(id);
    const auto may_answer = [&](Asked::By by) {
        return asked.answered_by(now, id, pdu, by) != nullptr;
    };
    const bool outstanding = may_answer(Asked::By::us);
    // Where copies are not known, a late reply comes first.
    const bool copy = station != nullptr && (station->trail().copies() || !outstanding) &&
                      asked.is_last_reply(now, id, pdu, station->trail().longest());
    return facts | (answers ? facts_of_answer(now, pdu) : 0) |
           when(may_answer(Asked::By::other_master), fact::other_master) |
           when(may_answer(Asked::By::broadcast), fact::broadcast) | when(copy, fact::copy) |
           when(outstanding, fact::outstanding) |
           when(asked.has_last_form(now, id, pdu, timing::kSecondPanel), fact::last_form) |
           when(station != nullptr, fact::known);
}

/// A client's request waits until no exception can be an older request's; a proof goes sooner.
Facts Arbiter::facts_of_answer(TimePoint now, ByteView pdu) const {
    const Group& group = active_->group();
    const Asked* const older =
        is_refusal(pdu) ? stations_.outstanding().answered_by(now, group.station, pdu) : nullptr;
    const bool refuses_older = older != nullptr && older->pdu != group.request.pdu();
    return when(active_->is_own_echo(pdu), fact::own_echo) |
           when(refuses_older, fact::refuses_older);
}

/// Returns the lateness of a late reply, else 0.
Duration Arbiter::carry_out(TimePoint now, const Unused& part, Done done) {
    Station* const station =
        part.kind == Unused::Kind::damaged ? nullptr : stations_.find(part.bytes[0]);
    switch (done) {
        case Done::accept:
        case Done::broadcast:
        case Done::second:
            break;
        case Done::contested:
            active_->on_contested();
            break;
        case Done::echo:
            if (active_ && !active_->is_broadcast()) active_->on_echo();
            quiet_.has_come();
            break;
        case Done::request:
            leave_to_other_master(now, part.bytes);
            break;
        case Done::damaged:
            if (Station* const last = active_ ? nullptr : stations_.find(replied_))
                last->on_followed(now, false);
            break;
        case Done::nobodys:
            stations_.outstanding().on_other_answered(now, part.bytes[0],
                                                      modbus::pdu_of(part.bytes));
            quiet_.has_come();
            break;
        case Done::copy:
            station->on_followed(now, true);
            quiet_.trail_has_come();
            break;
        case Done::late:
            return take_late(now, part);
        case Done::wrong:
            take_wrong(part.bytes);
            break;
    }
    return {};
}

/// A late reply shows that its station has served the older requests of the same connection, and
/// that the line holds back nothing older of any station (T8).
Duration Arbiter::take_late(TimePoint now, const Unused& part) {
    const std::uint8_t id = part.bytes[0];
    Station& station = stations_.of(id);
    const ByteView pdu = modbus::pdu_of(part.bytes);
    const bool is_open =
        active_ && active_->group().station == id &&
        modbus::answers(active_->group().request.pdu(), pdu, active_->group().request.byte_count());
    const auto asked = stations_.outstanding().on_late(now, id, pdu, is_open);
    const Duration lateness =
        std::max(now - asked->sent - station.settings().response_timeout, Duration{});
    stations_.outstanding().on_delivered(now, asked->sent);
    if (station.on_late(now, lateness)) {
        stations_.on_recovery();
        outbox_.event(StationEvent::Kind::online, id);
    }
    outbox_.event(StationEvent::Kind::late, id, lateness);
    if (station.trail().copies()) quiet_.trail_until(station.trail().until());
    if (!stations_.outstanding().any(now, id)) quiet_.lift(now, id);
    return lateness;
}

/// The station has said something else: the reply may still come where the function is another one.
void Arbiter::take_wrong(ByteView adu) {
    if (!active_ || active_->group().station != adu[0]) return;
    const bool is_asked = modbus::plain_function(adu[1]) == active_->group().request.function();
    active_->on_wrong(is_asked, is_refusal(modbus::pdu_of(adu)));
}

/// Another master asks: sending now would damage the reply to it (T9). The line rests as long as
/// our slowest panel has needed, or a usual time.
void Arbiter::leave_to_other_master(TimePoint now, ByteView request) {
    const std::size_t size = modbus::request_adu_length(request);
    const ByteView pdu = modbus::pdu_of(request.first(size));
    stations_.outstanding().add(request[0], {.by = Asked::By::other_master,
                                             .sent = now,
                                             .until = now + timing::kForeignReply,
                                             .pdu = Bytes(pdu.begin(), pdu.end())});
    if (request.size() > size || request[0] == kBroadcast) return;  // its reply was heard as well
    const Duration reply = frame_time(
        settings_.serial, modbus::reply_length_from_request(pdu).value_or(modbus::kReadRequestAdu));
    const Duration think = std::clamp(3 * stations_.slowest().value_or(timing::kForeignThink),
                                      timing::kShortestForeign, timing::kLongestForeign);
    quiet_.await_until(now + silent_interval(settings_.serial) + think + reply);
}

}  // namespace panelgate::arbiter
