#include "attempt.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::scan {

namespace {

bool is_plausible(ByteView bytes) {
    const std::uint8_t function = modbus::plain_function(bytes[1]);
    if (bytes[0] > modbus::kMaxStation || !modbus::is_known(function)) return false;
    return bytes[0] != 0 || modbus::is_broadcastable(bytes[1]);
}

struct Found {
    std::size_t length = 0;
    modbus::CrcOrder order = modbus::CrcOrder::low_first;
};

/// Returns the valid frame at the start of `bytes`.
std::optional<Found> frame_at_front(ByteView bytes) {
    if (bytes.size() < modbus::kMinAdu || !is_plausible(bytes)) return std::nullopt;
    const modbus::ReplyLength reply = modbus::reply_length(bytes);
    const bool known = reply.kind == modbus::ReplyLength::Kind::known;
    for (const std::size_t length :
         std::array<std::size_t, 3>{known ? reply.length : 0, modbus::kReadRequestAdu,
                                    modbus::request_adu_length(bytes)}) {
        if (length < modbus::kMinAdu || length > bytes.size()) continue;
        for (const auto& [word, order] : modbus::kCrcOrders) {
            if (modbus::crc_ok(bytes.first(length), order)) return Found{length, order};
        }
    }
    return std::nullopt;
}

}  // namespace

Heard extract_frames(ByteView bytes) {
    Heard heard;
    while (!bytes.empty()) {
        const auto found = frame_at_front(bytes);
        if (!found) {
            ++heard.damaged;
            bytes = bytes.subspan(1);
            continue;
        }
        const ByteView pdu = bytes.subspan(1, found->length - modbus::kAduOverhead);
        heard.frames.push_back({bytes[0], Bytes(pdu.begin(), pdu.end()), found->order});
        bytes = bytes.subspan(found->length);
    }
    return heard;
}

namespace {

/// USB adapters deliver bytes up to 16 ms late (FTDI AN232B-04).
constexpr Duration kAdapterPause = 25ms;
constexpr std::size_t kPauseCharacters = 5;
constexpr Duration kBabble = 300ms;
/// Fewer damaged bytes come from a transceiver switching over, not from a reply.
constexpr std::size_t kMinDamage = 3;

}  // namespace

Attempt::Attempt(ReadRequest request, const SerialFormat& format, TimePoint sent,
                 ReplyTimeouts timeouts)
    : request_(std::move(request)),
      start_by_(sent + frame_time(format, request_.adu().size()) + timeouts.start),
      latest_(start_by_ + kBabble + frame_time(format, modbus::kMaxLongRtuAdu)),
      settle_(timeouts.settle),
      gap_(std::max(kAdapterPause, wire_time(format, kPauseCharacters))) {}

/// Removes a partial echo, too: the rest is still coming.
ByteView Attempt::without_echo() const {
    const Bytes& sent = request_.adu();
    const auto same = std::ranges::mismatch(heard_, sent);
    const bool echo = same.in1 == heard_.end() || same.in2 == sent.end();
    return echo ? ByteView(heard_).subspan(std::min(heard_.size(), sent.size())) : ByteView(heard_);
}

bool Attempt::contains_header(ByteView bytes) const {
    for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
        const std::uint8_t function = modbus::plain_function(bytes[i + 1]);
        if (bytes[i] == request_.station() && function == request_.pdu()[0]) return true;
    }
    return false;
}

void Attempt::on_rx(TimePoint now, ByteView bytes) {
    last_rx_ = now;
    append_up_to(kMaxHeard, heard_, bytes);
    const Outcome so_far = finish();
    replied_ = so_far.kind == Outcome::Kind::replied;
    header_seen_ = so_far.header_seen;
}

TimePoint Attempt::ends_at() const {
    if (without_echo().empty()) return start_by_;
    if (replied_) return std::min(latest_, last_rx_ + settle_);
    if (header_seen_) return std::min(latest_, last_rx_ + std::max(gap_, settle_));
    return std::min(latest_, std::max(start_by_, last_rx_ + gap_));
}

Outcome Attempt::finish() const {
    Outcome outcome;
    Heard heard = extract_frames(without_echo());
    for (Frame& frame : heard.frames) {
        const bool ours = frame.station == request_.station() &&
                          frame.crc_order == request_.crc_order() &&
                          modbus::answers(request_.pdu(), frame.pdu);
        if (!ours) {
            outcome.unsolicited.push_back(std::move(frame));
        } else if (outcome.kind == Outcome::Kind::replied) {
            ++outcome.more;
        } else {
            outcome.kind = Outcome::Kind::replied;
            outcome.reply = std::move(frame.pdu);
        }
    }
    const bool damaged = heard.damaged >= kMinDamage;
    outcome.with_damage = damaged && outcome.kind == Outcome::Kind::replied;
    if (damaged && !outcome.with_damage) {
        outcome.kind = Outcome::Kind::damaged;
        outcome.header_seen = contains_header(without_echo());
    }
    return outcome;
}

}  // namespace panelgate::scan
