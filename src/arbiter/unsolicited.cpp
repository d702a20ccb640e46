#include "panelgate/arbiter/unsolicited.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/echo.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

using modbus::Unused;
using Kind = StationEvent::Kind;
using fact::when;

namespace {

/// True for a good frame that can only be another master's request.
bool is_request(ByteView adu) {
    const modbus::ReplyLength as_reply = modbus::reply_length(adu);
    const bool fits_reply =
        as_reply.kind == modbus::ReplyLength::Kind::known && as_reply.length == adu.size();
    return !fits_reply && modbus::request_adu_length(adu) == adu.size();
}

/// A frame whose last byte is 0 has a good CRC without it, too.
bool lacks_last_byte(ByteView heard, ByteView frame) {
    return heard.size() + 1 == frame.size() && std::ranges::equal(heard, frame.first(heard.size()));
}

bool is_exception(ByteView adu) { return modbus::exception_of(modbus::pdu_of(adu)).has_value(); }

}  // namespace

void UnsolicitedFrames::hear(TimePoint now, ByteView bytes) {
    if (bytes.empty()) return;
    if (idle_.empty()) arrivals_ = {};
    idle_.insert(idle_.end(), bytes.begin(), bytes.end());
    arrivals_.add(now, bytes.size());
}

std::vector<Unused> UnsolicitedFrames::take(std::uint8_t asked) {
    if (serial_.mode == SerialMode::ascii) return take_delimited(asked, false);
    std::vector<Unused> parts = modbus::classify_heard(std::exchange(idle_, {}), asked, orders_);
    std::size_t behind = 0;
    for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
        part->came = arrivals_.before(behind);
        behind += part->bytes.size();
    }
    return parts;
}

std::vector<Unused> UnsolicitedFrames::take_delimited(std::uint8_t asked, bool good) {
    const Bytes bytes = std::exchange(idle_, {});
    if (bytes.empty()) return {};
    return {modbus::classify_frame(bytes, asked, good && modbus::crc_ok(bytes, orders_))};
}

std::vector<Unused> UnsolicitedFrames::joined(TimePoint now, std::vector<Unused> parts,
                                              const Stations& stations) {
    for (Unused& part : parts) {
        Bytes whole = std::exchange(cut_, {});
        if (part.kind != Unused::Kind::damaged) continue;
        const bool first = whole.empty();
        whole.insert(whole.end(), part.bytes.begin(), part.bytes.end());
        const bool good = modbus::crc_ok(whole, orders_);
        const Facts wanted = fact::own_frame | fact::request | fact::other_master | fact::repeats;
        if ((facts_of(now, whole, !good, stations) & wanted) != 0) {
            const TimePoint came = part.came;
            if (!first) part = modbus::classify_frame(whole, part.station, good);
            part.came = came;
        } else if (const ByteView late = stations.book().late_in(whole, orders_); !late.empty()) {
            part.station = late[0];
            cut_.assign(late.end(), ByteView(whole).end());
        } else if (whole.size() < modbus::kMaxRtuAdu) {
            cut_ = std::move(whole);
        }
    }
    return parts;
}

Facts UnsolicitedFrames::facts_of(TimePoint now, ByteView adu, bool damaged,
                                  const Stations& stations) const {
    const bool begins = begins_with_request(adu, last_frame_, orders_);
    const bool own = std::ranges::equal(adu, last_frame_) || is_own(now, adu) ||
                     (!damaged && lacks_last_byte(adu, last_frame_));
    const Facts facts = when(own, fact::own_frame) |
                        when(begins && (damaged || is_request(adu)), fact::request) |
                        when(damaged, fact::damaged);
    if (damaged) return facts;
    const OutstandingRequests& book = stations.book();
    const ByteView pdu = modbus::pdu_of(adu);
    const Facts more = facts | when(book.behind_broadcast(now, pdu).has_value(), fact::broadcast);
    if (const Station* station = stations.find(adu[0]))
        return more | station->replies().facts(book, now, pdu);
    return more | when(book.claims(now, adu[0], pdu, {}).other_master, fact::other_master);
}

void UnsolicitedFrames::note(TimePoint now, const std::vector<modbus::Unused>& parts, bool idle,
                             Stations& stations, Quiet& quiet, Outbox& outbox) {
    for (const Unused& part : parts) {
        const TimePoint heard_at =
            part.came != TimePoint{} ? part.came : std::min(now, quiet.since());
        const bool damaged = part.kind == Unused::Kind::damaged;
        const Facts facts = facts_of(heard_at, part.bytes, damaged, stations);
        const Done done = judge(facts);
        if (is_reply(done)) {
            const bool asked = !idle && part.station == quiet.station();
            note_reply(now, heard_at, part, done, asked, stations, quiet, outbox);
            continue;
        }
        outbox.on_unsolicited(now, part, done, quiet.station());
        if (done == Done::damaged) stations.on_damaged(heard_at, part.bytes);
        if (done == Done::damaged && part.station != 0)
            note_life(heard_at, part.station, stations, outbox);
        if ((done == Done::damaged || done == Done::echo) && idle)
            stations.on_trail(heard_at, replied_);
        if (done == Done::echo) quiet.has_come();
        if (done == Done::echo && (facts & fact::repeats) != 0)
            stations.of(part.bytes[0]).replies().on_perhaps_copied(heard_at);
        if (done == Done::request) stations.book().on_foreign(heard_at, part.bytes, false);
        if (done == Done::request) let_reply_pass(now, part.bytes, stations, quiet);
        if (done == Done::nobodys &&
            stations.book().on_foreign_answered(part.station, modbus::pdu_of(part.bytes)))
            quiet.has_come();
        if (done != Done::broadcast) continue;
        const auto delay = stations.book().behind_broadcast(heard_at, modbus::pdu_of(part.bytes));
        stations.on_broadcast_answered(part.station, *delay, is_exception(part.bytes));
    }
}

/// A reply of a station that is not, or no longer, waited for.
void UnsolicitedFrames::note_reply(TimePoint now, TimePoint heard_at, const Unused& part, Done done,
                                   bool asked, Stations& stations, Quiet& quiet, Outbox& outbox) {
    const Station::Heard heard = stations.of(part.station)
                                     .on_unsolicited_frame(stations.book(), heard_at, done,
                                                           modbus::pdu_of(part.bytes), asked);
    outbox.on_unsolicited(now, part, done, quiet.station(), heard.lateness);
    if (is_late(done)) outbox.event(Kind::late, part.station, heard.lateness);
    if (is_late(done)) note_life(heard_at, part.station, stations, outbox);
    if (heard.settled) quiet.lift(now, part.station);
}

void UnsolicitedFrames::note_life(TimePoint now, std::uint8_t station, Stations& stations,
                                  Outbox& outbox) {
    if (!stations.of(station).on_sign_of_life(now)) return;
    stations.on_recovery();
    outbox.event(Kind::online, station);
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
    quiet.await_until(now + silent_interval(serial_) + think + reply);
}

bool UnsolicitedFrames::is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations,
                                       Duration heard_after) const {
    const Done done = judge(facts_of(now, adu, false, stations));
    if (done == Done::unasked) return true;
    if ((!is_late(done) && done != Done::duplicate) || !is_exception(adu)) return false;
    // An exception for another function may be meant for this request, even if it is outstanding:
    // asking again decides sooner than waiting. One that repeats an earlier one may be, too, where
    // the answer was due; a duplicate comes at any time.
    return is_late(done) || !stations.find(adu[0])->is_quicker_than_ever(heard_after);
}

}  // namespace panelgate::arbiter
