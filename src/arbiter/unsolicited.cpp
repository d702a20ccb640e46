#include "panelgate/arbiter/unsolicited.hpp"
#include "panelgate/arbiter/timing.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "verdict.hpp"

namespace panelgate::arbiter {

using modbus::Unused;
using Kind = StationEvent::Kind;
using Part = Outbox::Part;

namespace {

/// True for a good frame that can only be another master's request.
bool is_request(ByteView adu) {
    const modbus::ReplyLength as_reply = modbus::reply_length(adu);
    const bool fits_reply =
        as_reply.kind == modbus::ReplyLength::Kind::known && as_reply.length == adu.size();
    return !fits_reply && modbus::request_adu_length(adu) == adu.size();
}

Part part_of(Claim kind) {
    switch (kind) {
        case Claim::late:
            return Part::late;
        case Claim::duplicate:
        case Claim::second:
            return Part::duplicate;
        case Claim::unasked:
            return Part::unasked;
    }
    std::abort();
}

/// How long after a recent broadcast this reply to it came, from a panel that should be silent;
/// empty: it is none.
std::optional<Duration> delay_behind_broadcast(TimePoint now, ByteView adu,
                                               const Stations& stations) {
    return stations.broadcasts().delay_of(now, modbus::pdu_of(adu));
}

}  // namespace

void UnsolicitedFrames::hear(ByteView bytes) {
    idle_.insert(idle_.end(), bytes.begin(), bytes.end());
}

std::vector<Unused> UnsolicitedFrames::take(std::uint8_t asked) {
    if (serial_.mode == SerialMode::ascii) return take_delimited(asked, false);
    return modbus::classify_heard(std::exchange(idle_, {}), asked, orders_);
}

std::vector<Unused> UnsolicitedFrames::take_delimited(std::uint8_t asked, bool good) {
    const Bytes bytes = std::exchange(idle_, {});
    if (bytes.empty()) return {};
    return {modbus::classify_frame(bytes, asked, good && modbus::crc_ok(bytes, orders_))};
}

Part UnsolicitedFrames::judge(TimePoint now, const Unused& part, const Stations& stations) const {
    if (std::ranges::equal(part.bytes, last_frame_)) return Part::echo;
    if (begins_with_request(part.bytes, last_frame_, orders_) &&
        (part.kind == Unused::Kind::damaged || is_request(part.bytes)))
        return Part::request;
    if (part.kind == Unused::Kind::damaged) return Part::damaged;
    // It must not be taken for anything else it might be.
    if (answers_other_master(now, part.bytes)) return Part::unknown;
    const Station* station = stations.find(part.station);
    const bool explained =
        station != nullptr &&
        station->requests().claim_of(now, modbus::pdu_of(part.bytes)) != Claim::unasked;
    if (!explained && delay_behind_broadcast(now, part.bytes, stations))
        return Part::broadcast_reply;
    return station == nullptr ? Part::unknown : Part::unasked;
}

void UnsolicitedFrames::note(TimePoint now, const std::vector<Unused>& parts, bool idle,
                             Stations& stations, Quiet& quiet, Outbox& outbox) {
    const TimePoint heard_at = std::min(now, quiet.since());
    for (const Unused& part : parts) {
        const Part what = judge(heard_at, part, stations);
        if (what != Part::unasked) {
            outbox.on_unsolicited(now, part, what, quiet.station());
            if (what == Part::damaged) stations.on_damaged(heard_at, part.bytes);
            if (what == Part::broadcast_reply) learn_of_broadcasts(heard_at, part, stations);
            if (what == Part::damaged && idle) stations.on_trail(heard_at, replied_);
            if (what == Part::request) foreign_requests_.on_heard(heard_at, part.bytes);
            if (what == Part::request) let_reply_pass(now, part.bytes, stations, quiet);
            continue;
        }
        const bool asked = !idle && part.station == quiet.station();
        const Station::Heard heard =
            stations.of(part.station)
                .on_unsolicited_frame(heard_at, modbus::pdu_of(part.bytes), asked);
        outbox.on_unsolicited(now, part, part_of(heard.claim), quiet.station(), heard.lateness);
        if (heard.claim == Claim::late) outbox.event(Kind::late, part.station, heard.lateness);
        if (heard.back) {
            stations.on_recovery();
            outbox.event(Kind::online, part.station);
        }
        if (heard.settled) quiet.lift(now, part.station);
    }
}

void UnsolicitedFrames::learn_of_broadcasts(TimePoint now, const Unused& part, Stations& stations) {
    const bool refused = modbus::exception_of(modbus::pdu_of(part.bytes)).has_value();
    if (const auto delay = delay_behind_broadcast(now, part.bytes, stations))
        stations.on_broadcast_answered(part.station, *delay, refused);
}

bool UnsolicitedFrames::answers_other_master(TimePoint now, ByteView adu) const {
    return foreign_requests_.fit(adu, now - timing::kLatestRepetition);
}

/// Another master asks: sending now would damage the reply to it. Wait as long as our slowest panel
/// has needed, or a usual time.
void UnsolicitedFrames::let_reply_pass(TimePoint now, ByteView request, const Stations& stations,
                                       Quiet& quiet) const {
    const std::size_t size = modbus::request_adu_length(request);
    const ByteView pdu = modbus::pdu_of(request.first(size));
    if (request.size() > size || request[0] == kBroadcast) return;  // its reply was heard as well
    constexpr std::size_t kShort = modbus::kReadRequestAdu;
    const Duration reply =
        frame_time(serial_, modbus::reply_length_from_request(pdu).value_or(kShort));
    const Duration think = std::clamp(3 * stations.slowest().value_or(timing::kForeignThink),
                                      timing::kShortestForeign, timing::kLongestForeign);
    quiet.rest_until(now + silent_interval(serial_) + think + reply);
}

bool UnsolicitedFrames::is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations,
                                       Duration heard_after) const {
    if (std::ranges::equal(adu, last_frame_) || is_request(adu) ||
        delay_behind_broadcast(now, adu, stations) || answers_other_master(now, adu))
        return false;
    const Station* station = stations.find(adu[0]);
    if (station == nullptr) return false;
    const Claim kind = station->requests().claim_of(now, modbus::pdu_of(adu));
    if (kind == Claim::unasked) return true;
    // An exception for another function may be meant for this request, even if it is outstanding:
    // asking again decides sooner than waiting. One that repeats an earlier one may be, too, where
    // the answer was due; a duplicate comes at any time.
    const bool in_time = !station->is_quicker_than_ever(heard_after);
    const bool may_be_meant = kind == Claim::late || (kind == Claim::duplicate && in_time);
    return may_be_meant && modbus::exception_of(modbus::pdu_of(adu));
}

}  // namespace panelgate::arbiter
