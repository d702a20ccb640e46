// What is heard: the echo, the reply's bytes, and what belongs to nobody.

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

void Arbiter::on_rx(TimePoint now, ByteView bytes) {
    if (bytes.empty() || !up_) return;
    bytes = without_echo(now, bytes);
    if (bytes.empty()) {
        // The echo, or what may become it.
    } else if (!active_ || active_->group.station == kBroadcast || is_stale(now)) {
        if (active_) active_->clean = false;
        hear_idle(now, bytes);
    } else if (echo_.mismatch()) {
        collide(now, bytes);
    } else {
        if (!active_->heard) active_->first_byte = now;
        active_->last_byte = now;
        active_->heard = true;
        quiet_since_ = std::max(active_->sent, now);
        if (auto reply = active_->framer.feed(bytes)) settle(now, *reply);
    }
    step(now);
}

/// Drivers and adapters begin to send later than asked, and by an unknown time: what is computed is
/// the earliest end.
void Arbiter::on_end(TimePoint now, Duration left) {
    constexpr Duration kMaxShift = 1s;
    if (!wants_end(now)) return;
    Active& a = *active_;
    const Duration shift = now + left - a.sent;
    if (left <= Duration::zero() || a.heard || a.sent + shift > a.computed + kMaxShift) {
        a.end_confirmed = true;
        return;
    }
    a.sent += shift;
    a.give_up += shift;
    a.longest += shift;
    quiet_since_ = std::max(quiet_since_, a.sent);
}

/// P8: our own frame is taken out of what is heard, also behind a broadcast or a timeout.
ByteView Arbiter::without_echo(TimePoint now, ByteView bytes) {
    const bool before = echo_.complete();
    const bool was_wrong = echo_.mismatch();
    const ByteView rest = echo_.feed(bytes);
    if (rest.size() < bytes.size()) quiet_since_ = std::max(quiet_since_, now);
    if (active_ && echo_.pending()) active_->last_byte = now;
    if (active_ && echo_.complete() && !before) ++symptoms_of(active_->group.station).echoes;
    if (active_ && echo_.complete() && !before && echo_memory_.on_echo(active_->group.pdu)) {
        actions_.push_back(StationEvent{StationEvent::Kind::echo, active_->group.station, {}});
    }
    if (active_ && echo_.mismatch() && !was_wrong) {
        ++counters_of(active_->group.station).echo_mismatches;
        echo_memory_.on_mismatch();
        actions_.push_back(StationEvent{StationEvent::Kind::collision, active_->group.station, {}});
    }
    return rest;
}

/// Instead of our own frame something else was heard: whatever follows cannot be trusted.
void Arbiter::collide(TimePoint now, ByteView bytes) {
    Active& a = *active_;
    a.last_byte = now;
    a.heard = true;
    quiet_since_ = std::max(a.sent, now);
    append_up_to(modbus::ReplyFramer::kMaxHeard, a.collided, bytes);
}

/// No reply can begin before the request has left and the silence after it told the station so. On
/// a real UART, or a line that has shown to behave like one, such bytes are old (P1).
bool Arbiter::is_stale(TimePoint now) const {
    constexpr int kEnough = 3;
    const bool paced = settings_.paced || (timely_replies_ >= kEnough && early_replies_ == 0);
    return paced && !active_->heard && now < active_->sent + silent_interval(settings_.serial);
}

/// Bytes that nobody asked for (MST-04): counted, never matched with a later request.
void Arbiter::hear_idle(TimePoint now, ByteView bytes) {
    quiet_since_ = std::max(quiet_since_, now);
    idle_heard_.insert(idle_heard_.end(), bytes.begin(), bytes.end());
    if (idle_heard_.size() > modbus::ReplyFramer::kMaxHeard) judge_idle(now);
}

void Arbiter::judge_idle(TimePoint now) {
    if (idle_heard_.empty()) return;
    const Bytes heard = std::exchange(idle_heard_, {});
    const std::vector<modbus::Unused> parts = modbus::classify_heard(heard, last_station_);
    count_strays(parts);
    note_unused(now, parts);
}

/// Counts and traces what was heard and is nobody's answer.
void Arbiter::note_unused(TimePoint now, const std::vector<modbus::Unused>& parts) {
    for (const modbus::Unused& part : parts) {
        const bool good = part.kind != modbus::Unused::Kind::damaged;
        const bool known = good && stations_.contains(part.station);
        counters_of(known ? part.station : last_station_).discarded_bytes += part.bytes.size();
        std::string_view what = good ? "foreign" : "damaged";
        if (known && part.kind == modbus::Unused::Kind::own) what = "late";
        if (known && stations_.at(part.station).owed > 0) what = "late";
        if (what == "late") ++counters_of(part.station).late_frames;
        if (what == "foreign") ++counters_of(last_station_).foreign_frames;
        actions_.push_back(Note{now, Note::Direction::discarded, part.bytes, what, {}});
        if (good) count_unasked(now, part);
        if (known) on_good_frame(now, part);
    }
}

/// A good frame of a station that we know, outside its transaction: perhaps the reply that is owed.
void Arbiter::on_good_frame(TimePoint now, const modbus::Unused& part) {
    Station& station = stations_.at(part.station);
    const ByteView pdu = ByteView(part.bytes).subspan(1, part.bytes.size() - kAduOverhead);
    if (station.owed == 0) station.copies.on_unasked(now, pdu);
    if (station.owed == 0 || !modbus::answers(station.unanswered, pdu)) return;
    --station.owed;
    const Duration lateness = std::max(now - station.due, Duration::zero());
    station.late.on_late(lateness);
    actions_.push_back(StationEvent{StationEvent::Kind::late, part.station, lateness});
    if (station.health.on_reply(now)) {
        actions_.push_back(StationEvent{StationEvent::Kind::online, part.station, {}});
    }
}

}  // namespace panelgate::arbiter
