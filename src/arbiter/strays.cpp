#include "panelgate/arbiter/strays.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

using modbus::Unused;
using Kind = StationEvent::Kind;
using Part = Ledger::Part;

namespace {

/// A good frame that can only be a request, another master's.
bool is_request(ByteView adu) {
    const modbus::ReplyLength as_reply = modbus::reply_length(adu);
    const bool fits_reply =
        as_reply.kind == modbus::ReplyLength::Kind::known && as_reply.length == adu.size();
    return !fits_reply && modbus::request_adu_length(adu) == adu.size();
}

Part part_of(Stray stray) {
    switch (stray) {
        case Stray::late:
            return Part::late;
        case Stray::copy:
        case Stray::second:
            return Part::copy;
        case Stray::unasked:
            return Part::unasked;
    }
    std::abort();
}

}  // namespace

void Strays::hear(ByteView bytes) { idle_.insert(idle_.end(), bytes.begin(), bytes.end()); }

std::vector<Unused> Strays::take(std::uint8_t asked) {
    if (serial_.mode == SerialMode::ascii) return take_told(asked, false);
    return modbus::classify_heard(std::exchange(idle_, {}), asked, orders_);
}

std::vector<Unused> Strays::take_told(std::uint8_t asked, bool good) {
    const Bytes bytes = std::exchange(idle_, {});
    if (bytes.empty()) return {};
    return {modbus::told_part(bytes, asked, good && modbus::crc_ok(bytes, orders_))};
}

/// A reply to the broadcast of a moment ago: a panel that does not know that it should be silent.
bool Strays::answers_broadcast(ByteView adu) const {
    constexpr unsigned kRecent = 4;  // requests sent since
    return !broadcast_.empty() && sent_since_ <= kRecent &&
           modbus::answers(modbus::pdu_of(broadcast_), modbus::pdu_of(adu));
}

Part Strays::judge(TimePoint now, const Unused& part, const Stations& stations) const {
    if (std::ranges::equal(part.bytes, last_frame_)) return Part::echo;
    if (begins_with_request(part.bytes, last_frame_, orders_) &&
        (part.kind == Unused::Kind::damaged || is_request(part.bytes)))
        return Part::request;
    if (part.kind == Unused::Kind::damaged) return Part::damaged;
    // Whatever else it might be, it is not to be believed to be that.
    if (answers_other_master(now, part.bytes)) return Part::unknown;
    const Station* station = stations.find(part.station);
    const bool owed =
        station != nullptr && station->judge(now, modbus::pdu_of(part.bytes)) != Stray::unasked;
    if (!owed && answers_broadcast(part.bytes)) return Part::broadcast_reply;
    return station == nullptr ? Part::unknown : Part::unasked;
}

void Strays::note(TimePoint now, const std::vector<Unused>& parts, bool idle, Stations& stations,
                  Quiet& quiet, Ledger& ledger) {
    const TimePoint heard_at = std::min(now, quiet.since());
    for (const Unused& part : parts) {
        const Part what = judge(heard_at, part, stations);
        if (what != Part::unasked) {
            ledger.on_stray(now, part, what, quiet.station());
            if (what == Part::damaged) stations.on_damaged(heard_at, part.bytes);
            if (what == Part::broadcast_reply) stations.on_broadcast_answered(part.station);
            if (what == Part::damaged && idle) stations.on_trail(heard_at, replied_);
            if (what == Part::request) others_.on_heard(heard_at, part.bytes);
            if (what == Part::request) let_reply_pass(now, part.bytes, stations, quiet);
            continue;
        }
        const Station::Heard heard =
            stations.of(part.station).on_stray_frame(heard_at, modbus::pdu_of(part.bytes));
        ledger.on_stray(now, part, part_of(heard.stray), quiet.station(), heard.lateness);
        if (heard.stray == Stray::late) ledger.event(Kind::late, part.station, heard.lateness);
        if (heard.back) {
            stations.on_back();
            ledger.event(Kind::online, part.station);
        }
        if (heard.settled) quiet.lift(now, part.station);
    }
}

bool Strays::answers_other_master(TimePoint now, ByteView adu) const {
    constexpr Duration kLongest = 500ms;  // for a reply; its master would have asked again
    return others_.fit(adu, now - kLongest);
}

/// Another master asks: whoever speaks now damages the reply to it. Its panel has as long as ours
/// need at the most, or as many are used to.
void Strays::let_reply_pass(TimePoint now, ByteView request, const Stations& stations,
                            Quiet& quiet) const {
    const std::size_t size = modbus::request_adu_length(request);
    const ByteView pdu = modbus::pdu_of(request.first(size));
    if (request.size() > size || request[0] == kBroadcast) return;  // its reply is heard as well
    constexpr std::size_t kShort = modbus::kReadRequestAdu;
    const Duration reply =
        frame_time(serial_, modbus::reply_length_from_request(pdu).value_or(kShort));
    const Duration think = std::clamp<Duration>(3 * stations.slowest().value_or(10ms), 20ms, 100ms);
    quiet.rest_until(now + silent_interval(serial_) + think + reply);
}

bool Strays::is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations) const {
    if (std::ranges::equal(adu, last_frame_) || is_request(adu) || answers_broadcast(adu) ||
        answers_other_master(now, adu))
        return false;
    const Station* station = stations.find(adu[0]);
    if (station == nullptr) return false;
    // A refusal with the number of another function that is outstanding may be that of this
    // request: asking once more tells sooner than waiting.
    const Stray stray = station->judge(now, modbus::pdu_of(adu));
    return stray == Stray::unasked ||
           (stray == Stray::late && modbus::exception_of(modbus::pdu_of(adu)));
}

}  // namespace panelgate::arbiter
