// What tells a line's troubles apart. Everything here is counted and nothing depends on it.

#include <algorithm>
#include <bit>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
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

/// Of another master: not our own frame, which an adapter that is said to have no echo may give.
/// What is heard is cut into replies elsewhere, and a request glued to its reply would pass for
/// damage.
bool begins_with_request(ByteView heard, ByteView own) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size)) &&
           !std::ranges::equal(heard.first(size), own);
}

}  // namespace

void Arbiter::count_answered(std::size_t reply_size) {
    Symptoms& symptoms = symptoms_of(active_->group.station);
    ++symptoms.answered;
    ++symptoms.answered_after[pause_class(active_->pause)];
    if (reply_size >= Symptoms::kLongReply) ++symptoms.long_answered;
    symptoms.mute_in_a_row = 0;
}

/// An attempt without a reply; `parts` is all that was heard in it.
void Arbiter::count_failed(const std::vector<modbus::Unused>& parts) {
    const Active& a = *active_;
    Symptoms& symptoms = symptoms_of(a.group.station);
    Bytes damaged;
    for (const modbus::Unused& part : parts) {
        if (part.kind != modbus::Unused::Kind::damaged) continue;
        if (begins_with_request(part.bytes, echo_.frame())) {
            ++symptoms.unasked;
        } else {
            damaged.insert(damaged.end(), part.bytes.begin(), part.bytes.end());
        }
    }
    if (!a.collided.empty()) {
        ++symptoms.collided;
        symptoms.mute_in_a_row = 0;
    } else if (!damaged.empty()) {
        count_damaged(damaged);
        symptoms.mute_in_a_row = 0;
    } else {
        const bool silent = !a.heard && a.clean;
        ++(silent ? symptoms.silent : symptoms.disturbed);
        if (silent) ++symptoms.silent_after[pause_class(a.pause)];
        ++symptoms.mute_in_a_row;
    }
}

/// Its own line in the account of an attempt: what came instead of the reply.
void Arbiter::count_damaged(ByteView bytes) {
    const Group& group = active_->group;
    Symptoms& symptoms = symptoms_of(group.station);
    const auto expected = modbus::reply_length_from_request(group.pdu);
    const bool head = bytes.size() >= 2 && bytes[0] == group.station &&
                      (bytes[1] & ~modbus::kExceptionBit) == group.pdu[0];
    if (expected && bytes.size() == *expected) {
        ++symptoms.damaged_exact;
    } else if (expected && bytes.size() < *expected) {
        ++symptoms.damaged_short;
    } else {
        ++symptoms.damaged_long;
    }
    if (head) ++symptoms.damaged_heads;
    if (expected.value_or(bytes.size()) >= Symptoms::kLongReply) ++symptoms.long_damaged;
    symptoms.damaged_bytes += bytes.size();
    symptoms.damaged_odd += static_cast<std::uint64_t>(
        std::ranges::count_if(bytes, [](std::uint8_t b) { return std::popcount(b) % 2 == 1; }));
    symptoms.damaged_zeros += static_cast<std::uint64_t>(std::ranges::count(bytes, 0));
}

/// Damaged bytes that no attempt has failed by: before a good reply, behind it, or between.
void Arbiter::count_strays(const std::vector<modbus::Unused>& parts) {
    for (const modbus::Unused& part : parts) {
        if (part.kind != modbus::Unused::Kind::damaged) continue;
        Symptoms& symptoms = symptoms_of(last_station_);
        const bool request = begins_with_request(part.bytes, echo_.frame());
        ++(request ? symptoms.unasked : symptoms.strays);
    }
}

/// A good frame that no request was open for. Call before the reply that is owed is settled by it.
void Arbiter::count_unasked(TimePoint now, const modbus::Unused& part) {
    const auto found = stations_.find(part.station);
    if (found == stations_.end()) {
        ++symptoms_of(last_station_).unasked;
        return;
    }
    const Station& station = found->second;
    Symptoms& symptoms = symptoms_of(part.station);
    const ByteView pdu = ByteView(part.bytes).subspan(1, part.bytes.size() - kAduOverhead);
    constexpr Duration kLatest = 10s;
    const Duration lateness =
        now - station.due + station.timeout() - station.settings.response_timeout;
    const bool may_be_late = station.owed > 0 || lateness < kLatest;
    const bool is_open = active_ && active_->group.station == part.station;
    if (std::ranges::equal(part.bytes, echo_.frame())) {
        ++symptoms.echoes;  // or the reply to 05 or 06 twice, which looks the same
    } else if (station.owed == 0 && ((is_open && modbus::answers(active_->group.pdu, pdu)) ||
                                     station.copies.is_second(now, pdu))) {
        ++symptoms.doubled;
    } else if (may_be_late && !station.unanswered.empty() &&
               modbus::answers(station.unanswered, pdu)) {
        symptoms.mute_in_a_row = 0;
        if (lateness <= Duration::zero()) return;  // behind a wait that was cut short
        ++symptoms.late;
        symptoms.worst_lateness = std::max(symptoms.worst_lateness, lateness);
    } else {
        ++symptoms.unasked;
    }
}

}  // namespace panelgate::arbiter
