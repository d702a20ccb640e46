#include "panelgate/tap/cutter.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::tap {
namespace {

using modbus::ReplyLength;

/// Bytes of the longest request that a panel accepts: 0F with 255 data bytes.
constexpr std::size_t kLongest = modbus::kMaxLongRequestPdu + modbus::kAduOverhead;

/// Bytes of the longest frame of a function without a length rule. The more sizes are tried, the
/// more often a CRC fits by chance.
constexpr std::size_t kLongestUnknown = 128;

/// True if the reply repeats the request's bytes after the function.
bool is_echoed(std::uint8_t function) {
    return modbus::is_broadcastable(function) || function == modbus::kMaskWriteRegister;
}

bool begins_like(ByteView frame, ByteView pdu) {
    constexpr std::size_t kSame = 5;  // function and two words
    const std::size_t size = std::min({frame.size() - 1, pdu.size(), kSame});
    return std::equal(frame.begin() + 1, frame.begin() + 1 + static_cast<std::ptrdiff_t>(size),
                      pdu.begin());
}

/// Length of the answer at the front of `frame`; empty if these bytes begin no answer.
std::optional<ReplyLength> answer_length(const PendingRequest& pending, ByteView frame) {
    if (frame[0] != pending.station || modbus::plain_function(frame[1]) != pending.pdu[0])
        return std::nullopt;
    const ReplyLength by_header = modbus::reply_length(frame);
    if (frame[1] != pending.pdu[0]) return by_header;
    if (is_echoed(frame[1]) && !begins_like(frame, pending.pdu)) return std::nullopt;
    const auto expected = modbus::reply_length_from_request(pending.pdu);
    if (!expected || by_header.kind == ReplyLength::Kind::need_more) return by_header;
    if (by_header.kind == ReplyLength::Kind::known && by_header.length != *expected)
        return std::nullopt;
    return ReplyLength{ReplyLength::Kind::known, *expected};
}

/// True if a master could send this request. Checked only after damage (T3), where a CRC may fit by
/// chance.
bool makes_sense(std::uint8_t station, ByteView pdu) {
    if (!modbus::is_known(pdu[0])) return false;
    if (station == 0 && !modbus::is_broadcastable(pdu[0])) return false;
    if (!modbus::check_request(pdu, modbus::QuantityCheck::wide)) return false;
    if (pdu[0] <= modbus::kReadInputRegisters) return modbus::read_span(pdu).has_value();
    if (pdu[0] == modbus::kWriteSingleCoil)
        return pdu[4] == 0 && (pdu[3] == 0 || pdu[3] == 0xFF);  // AP 6.5
    return true;
}

bool is_exception_known(ByteView frame) {
    constexpr std::uint8_t kLast = 0x0B;  // AP 7
    return modbus::is_known(modbus::plain_function(frame[1])) && frame[2] >= 1 && frame[2] <= kLast;
}

bool is_exception(ByteView frame) { return (frame[1] & modbus::kExceptionBit) != 0; }

}  // namespace

Cutter::Cutter(const Settings& settings)
    : character_(character_time(settings.serial)), damaged_run_(settings.damaged_run) {}

void Cutter::hear(TimePoint now, ByteView bytes) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        const auto behind = static_cast<Duration::rep>(bytes.size() - 1 - i);
        last_ = std::max(last_, now - behind * character_);
        heard_.push_back(bytes[i]);
        times_.push_back(last_);
    }
}

std::optional<Piece> Cutter::next(const PendingRequest* pending, bool silence) {
    std::size_t at = looked_;
    for (; at < std::min(heard_.size(), damaged_run_); ++at) {
        const Verdict verdict = judge(at, pending, silence);
        if (verdict.kind == Verdict::Kind::nothing) continue;
        if (verdict.kind == Verdict::Kind::open) break;
        return at == 0 ? cut(verdict.size, verdict) : cut(at, {});
    }
    const bool ended = silence && at > 0 && at == heard_.size();
    if (ended || at >= damaged_run_) {
        Piece piece = cut(at, {});
        aligned_ = ended;
        return piece;
    }
    looked_ = at;
    return std::nullopt;
}

/// What begins at `start`. With `silence` the result is never open.
Cutter::Verdict Cutter::judge(std::size_t start, const PendingRequest* pending,
                              bool silence) const {
    const ByteView frame = ByteView(heard_).subspan(start);
    const Verdict waits{silence ? Verdict::Kind::nothing : Verdict::Kind::open, 0};
    if (frame[0] > modbus::kMaxStation) return {};
    if (frame.size() < 2) return waits;
    if (modbus::plain_function(frame[1]) == 0) return {};
    const bool aligned = start == 0 && aligned_;
    bool open = false;
    const auto answer = pending != nullptr ? answer_length(*pending, frame) : std::nullopt;
    if (answer) {
        const std::size_t size = size_of(start, *answer, silence, open);
        if (size != 0 && modbus::answers(pending->pdu, modbus::pdu_of(frame.first(size))))
            return {Verdict::Kind::frame, size, Piece::Kind::answer, is_request(start, size)};
        if (open) return waits;
    }
    if (!is_exception(frame)) {
        const std::size_t size = size_of(start, modbus::usual_request_length(frame), silence, open);
        if (size != 0 && (aligned || makes_sense(frame[0], modbus::pdu_of(frame.first(size)))))
            return {Verdict::Kind::frame, size, Piece::Kind::request};
        // A zero appended to a good frame leaves it good: its first seven bytes may pass for a
        // reply.
        if (open) return waits;
    }
    const std::size_t size = size_of(start, modbus::reply_length(frame), silence, open);
    if (size != 0 && (aligned || !is_exception(frame) || is_exception_known(frame)))
        return {Verdict::Kind::frame, size, Piece::Kind::reply};
    return open ? waits : Verdict{};
}

/// Size of the good frame; 0: there is no good frame. `open`: more bytes may complete a frame.
std::size_t Cutter::size_of(std::size_t start, const ReplyLength& length, bool silence,
                            bool& open) const {
    const ByteView frame = ByteView(heard_).subspan(start);
    switch (length.kind) {
        case ReplyLength::Kind::need_more:
            open = open || !silence;
            return 0;
        case ReplyLength::Kind::by_silence:
            return start == 0 && aligned_ ? size_by_gap(silence, open) : 0;
        case ReplyLength::Kind::known:
            break;
    }
    if (length.length > kLongest) return 0;
    if (length.length > frame.size()) {
        open = open || !silence;
        return 0;
    }
    return modbus::crc_ok(frame.first(length.length)) ? length.length : 0;
}

/// Size of a frame of unknown length, which ends at a gap, at the beginning of a frame of known
/// length, or at a silence. Only at the front, where a frame is due.
std::size_t Cutter::size_by_gap(bool silence, bool& open) const {
    const ByteView all(heard_);
    const std::vector<std::size_t> ends = good_ends(0);
    for (std::size_t i = 0; i < ends.size(); ++i) {
        // A zero appended to a good frame leaves it good.
        const bool last = i + 1 == ends.size() || ends[i + 1] != ends[i] + 1;
        if (last && is_gap_behind(ends[i] - 1)) return ends[i];
        if (goes_on_well(ends[i], true)) return ends[i];
    }
    if (!silence) {
        open = open || all.size() <= kLongestUnknown;
        return 0;
    }
    if (ends.empty()) return 0;
    if (ends.back() == all.size()) return ends.back();
    std::size_t end = 0;
    while (end + 1 < ends.size() && ends[end + 1] == ends[end] + 1) ++end;
    return ends[end];
}

/// Possible ends of a good frame that begins at `start`.
std::vector<std::size_t> Cutter::good_ends(std::size_t start) const {
    const ByteView frame = ByteView(heard_).subspan(start);
    std::vector<std::size_t> ends;
    std::uint16_t crc = modbus::crc16(ByteView());
    for (std::size_t i = 0; i < std::min(frame.size(), kLongestUnknown); ++i) {
        crc = modbus::crc16(crc, frame.subspan(i, 1));
        if (crc == 0 && i + 1 >= modbus::kMinAdu) ends.push_back(i + 1);
    }
    return ends;
}

/// True if a frame of known length begins at `start`, or, `through_another`, behind a frame of any
/// length at `start`.
bool Cutter::goes_on_well(std::size_t start, bool through_another) const {
    const ByteView frame = ByteView(heard_).subspan(start);
    if (frame.size() < modbus::kMinAdu || frame[0] > modbus::kMaxStation) return false;
    for (const ReplyLength& length :
         {modbus::usual_request_length(frame), modbus::reply_length(frame)}) {
        const bool whole = length.kind == ReplyLength::Kind::known && length.length <= frame.size();
        if (whole && modbus::crc_ok(frame.first(length.length))) return true;
    }
    if (!through_another) return false;
    return std::ranges::any_of(good_ends(start),
                               [&](std::size_t size) { return goes_on_well(start + size, false); });
}

bool Cutter::is_gap_behind(std::size_t place) const {
    constexpr int kCharacters = 3;  // t1.5 (serial line V1.02, 2.5.1.1), and the next character
    return place + 1 < times_.size() &&
           times_[place + 1] - times_[place] >= kCharacters * character_;
}

/// True if this good frame has the form of a request as well.
bool Cutter::is_request(std::size_t start, std::size_t size) const {
    const ByteView frame = ByteView(heard_).subspan(start, size);
    if (is_exception(frame)) return false;
    const ReplyLength length = modbus::usual_request_length(frame);
    const bool fits = length.kind == ReplyLength::Kind::by_silence || length.length == size;
    return fits && (!modbus::is_known(frame[1]) || makes_sense(frame[0], modbus::pdu_of(frame)));
}

Piece Cutter::cut(std::size_t size, const Verdict& verdict) {
    const auto end = heard_.begin() + static_cast<std::ptrdiff_t>(size);
    Piece piece;
    piece.kind = verdict.what;
    piece.ambiguous = verdict.ambiguous;
    piece.bytes.assign(heard_.begin(), end);
    piece.begin = times_.front() - character_;
    piece.end = times_[size - 1];
    heard_.erase(heard_.begin(), end);
    times_.erase(times_.begin(), times_.begin() + static_cast<std::ptrdiff_t>(size));
    looked_ = 0;
    aligned_ = verdict.kind == Verdict::Kind::frame;
    return piece;
}

}  // namespace panelgate::tap
