#include "panelgate/modbus/rtu_framer.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

/// Length of the reply at the front. 0: not known yet, or only by silence.
inline std::size_t known_reply_length(ByteView heard) {
    const ReplyLength length = reply_length(heard);
    return length.kind == ReplyLength::Kind::known ? length.length : 0;
}

namespace {

constexpr std::size_t kHeader = 3;  // of a reply: address, function, byte count or exception

ReplyLength known(std::size_t length) { return {ReplyLength::Kind::known, length}; }
ReplyLength need_more() { return {ReplyLength::Kind::need_more, 0}; }
ReplyLength by_silence() { return {ReplyLength::Kind::by_silence, 0}; }

/// 2B/0E: address, 2B, 0E, code, conformity, more, next id, n, then n objects of id, length, value.
ReplyLength device_identification_length(ByteView b) {
    constexpr std::size_t kFront = 8;
    if (b.size() < 3) return need_more();
    if (b[2] != kMeiDeviceIdentification) return by_silence();
    if (b.size() < kFront) return need_more();
    std::size_t at = kFront;
    for (unsigned object = 0; object < b[7]; ++object) {
        if (b.size() < at + 2) return need_more();
        at += 2u + b[at + 1];
        if (at + kCrcSize > kMaxRtuAdu) return by_silence();  // count and bytes disagree (FRM-10)
    }
    return known(at + kCrcSize);
}

ReplyLength by_count(ByteView b) {
    return b.size() < 3 ? need_more() : known(kReadReplyOverhead + b[2]);
}

}  // namespace

ReplyLength reply_length(ByteView b) {
    if (b.size() < 2) return need_more();
    if ((b[1] & kExceptionBit) != 0) return known(kExceptionAdu);
    switch (b[1]) {
        case kReadCoils:
        case kReadDiscreteInputs:
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kGetCommEventLog:
        case kReportServerId:
        case kReadFileRecord:
        case kWriteFileRecord:
        case kReadWriteMultipleRegisters:
            return by_count(b);
        case kWriteSingleCoil:
        case kWriteSingleRegister:
        case kGetCommEventCounter:
        case kWriteMultipleCoils:
        case kWriteMultipleRegisters:
            return known(8);
        case kReadExceptionStatus:
            return known(5);
        case kDiagnostics:
            if (b.size() < 4) return need_more();
            return b[2] == 0 && b[3] == 0 ? by_silence() : known(8);
        case kMaskWriteRegister:
            return known(10);
        case kReadFifoQueue:
            return b.size() < 4 ? need_more() : known(6u + b[2] * 256u + b[3]);
        case kEncapsulatedInterface:
            return device_identification_length(b);
        default:
            return by_silence();
    }
}

ReplyFramer::ReplyFramer(std::uint8_t station, Bytes request_pdu, const CrcOrders& orders,
                         Ends ends, ByteCount byte_count)
    : station_(station),
      request_(std::move(request_pdu)),
      orders_(orders),
      ends_(ends),
      byte_count_(byte_count),
      expected_(reply_length_from_request(request_, byte_count)) {}

std::optional<Bytes> ReplyFramer::feed(ByteView bytes) {
    heard_.insert(heard_.end(), bytes.begin(), bytes.end());
    if (ends_ == Ends::told) {
        find_start_at_head();
    } else if (auto reply = scan(false)) {
        return reply;
    }
    if (heard_.size() > kMaxHeard) discard(heard_.size() - kMaxHeard / 2);
    return std::nullopt;
}

std::optional<Bytes> ReplyFramer::on_silence() {
    auto reply = ends_ == Ends::told ? std::nullopt : scan(true);
    if (!reply) discard(heard_.size());
    return reply;
}

std::optional<Bytes> ReplyFramer::on_end(bool good) {
    std::optional<Bytes> reply;
    const bool whole = good && crc_ok(heard_, orders_);
    if (whole && heard_[0] == station_) reply = answering(heard_);
    if (!reply && !heard_.empty()) step_over(classify_frame(heard_, station_, whole));
    heard_.clear();
    forget_starts();
    open_length_ = false;
    return reply;
}

void ReplyFramer::on_cut() {
    const bool whole = damaged_whole_;
    const bool header = own_header_;
    discard(heard_.size());
    damaged_whole_ = whole;
    own_header_ = header;
}

/// The frame begins with the first byte fed.
void ReplyFramer::find_start_at_head() {
    if (looked_ > 0 || heard_.size() < 2) return;
    looked_ = heard_.size();
    open_length_ = is_start(heard_[0], heard_[1]);
    if (open_length_) starts_.push_back(0);
}

std::vector<Unused> ReplyFramer::take_unused() {
    behind_ = 0;
    return std::exchange(unused_, {});
}

/// Judges the possible starts in order. One that still waits for bytes blocks the later ones: bytes
/// inside a reply must not pass for a reply.
std::optional<Bytes> ReplyFramer::scan(bool silence) {
    collect_starts();
    open_length_ = false;
    inside_ = false;
    while (has_start()) {
        bool open = false;
        const std::size_t start = starts_[judged_];
        auto pdu = judge(start, silence, open);
        if (pdu) {
            const Inside inside = inside_other(start, start + pdu->size() + kAduOverhead);
            inside_ = inside == Inside::perhaps && !silence;
            if (inside_) return std::nullopt;
            if (inside != Inside::yes) return accept(start, std::move(*pdu));
        }
        if (open) {
            const ReplyLength length = reply_length(ByteView(heard_).subspan(start));
            open_length_ = expected_ || length.kind != ReplyLength::Kind::by_silence;
            return std::nullopt;
        }
        ++judged_;
    }
    return std::nullopt;
}

/// Whether [start, end) lies in another frame, whose data may look like the reply; `perhaps`
/// while that frame may still become complete.
ReplyFramer::Inside ReplyFramer::inside_other(std::size_t start, std::size_t end) const {
    Inside result = Inside::no;
    for (std::size_t i = 0; i < start; ++i) {
        const ByteView other = ByteView(heard_).subspan(i);
        if (other[0] == 0 || other[0] > kMaxStation) continue;
        for (const std::size_t size : {known_reply_length(other), request_adu_length(other)}) {
            if (size < kMinAdu || size > kMaxRtuAdu) continue;
            const bool whole = size <= other.size() && crc_ok(other.first(size), orders_);
            if (i + size > end && whole) return Inside::yes;
            if (i + size > end && size > other.size()) result = Inside::perhaps;
            if (i + size <= start && whole) {
                i += size - 1;
                break;
            }
        }
    }
    return result;
}

std::size_t ReplyFramer::missing() const {
    if (!has_start()) return ends_with_address() ? kHeader - 1 : 0;
    const ByteView rest = ByteView(heard_).subspan(starts_[judged_]);
    if (rest.size() < kHeader) return kHeader - rest.size();
    const ReplyLength length = reply_length(rest);
    const bool known = length.kind == ReplyLength::Kind::known;
    const bool asked = length.kind == ReplyLength::Kind::by_silence && expected_;
    const std::size_t whole = known ? length.length : asked ? *expected_ : 0;
    return whole > rest.size() ? whole - rest.size() : 0;
}

std::size_t ReplyFramer::missing_as_asked() const {
    if (!expected_ || !has_candidate()) return missing();
    const std::size_t start = has_start() ? starts_[judged_] : heard_.size() - 1;
    const std::size_t here = heard_.size() - start;
    const bool refused = here > 1 && (heard_[start + 1] & kExceptionBit) != 0;
    return refused || here >= std::min(kHeader, *expected_) ? missing() : *expected_ - here;
}

bool ReplyFramer::ends_with_other_frame() const {
    if (ends_ == Ends::told) return false;
    if (has_start() || heard_.size() < kMinAdu || heard_[0] != station_) return false;
    return known_reply_length(heard_) == heard_.size() && crc_ok(heard_, orders_);
}

bool ReplyFramer::is_start(std::uint8_t address, std::uint8_t function) const {
    return address == station_ && plain_function(function) == request_[0];
}

void ReplyFramer::forget_starts() {
    starts_.clear();
    judged_ = 0;
    looked_ = 0;
}

void ReplyFramer::collect_starts() {
    for (; looked_ + 1 < heard_.size(); ++looked_) {
        if (is_start(heard_[looked_], heard_[looked_ + 1])) starts_.push_back(looked_);
    }
}

/// Size of the frame at the front of `rest`: 0 = no frame possible; more than available = wait for
/// more.
std::size_t ReplyFramer::frame_size(ByteView rest, bool silence) const {
    ReplyLength want = reply_length(rest);
    const bool exception = (rest[1] & kExceptionBit) != 0;
    if (exception) return want.length;
    if (want.kind == ReplyLength::Kind::by_silence && expected_) want = known(*expected_);
    // If the object count disagrees with the bytes, silence and the CRC decide (FRM-10).
    const bool walked = rest[1] == kEncapsulatedInterface;
    const bool incomplete = want.kind != ReplyLength::Kind::known || want.length > rest.size();
    if (silence && incomplete && (walked || want.kind == ReplyLength::Kind::by_silence))
        return rest.size();
    if (want.kind != ReplyLength::Kind::known) return std::max(rest.size() + 1, kMinAdu);
    if (expected_ && want.length != *expected_) return 0;
    return want.length;
}

/// Returns the reply PDU if a valid reply begins at `start`. `open` is set if more bytes could
/// still complete one.
std::optional<Bytes> ReplyFramer::judge(std::size_t start, bool silence, bool& open) const {
    const ByteView rest = ByteView(heard_).subspan(start);
    const std::size_t size = frame_size(rest, silence);
    if (size < kMinAdu || size > kMaxLongRtuAdu) return std::nullopt;
    if (size > rest.size()) {
        open = !silence;
        return std::nullopt;
    }
    if (!crc_ok(rest.first(size), orders_) && rest[1] == kEncapsulatedInterface) {
        // The object count is too low: only silence marks the end (FRM-10).
        open = !silence;
        if (!silence || !crc_ok(rest, orders_)) return std::nullopt;
        return answering(rest);
    }
    return answering(rest.first(size));
}

/// Returns the PDU of this frame if it is valid and matches the request.
std::optional<Bytes> ReplyFramer::answering(ByteView frame) const {
    if (frame.size() > kMaxLongRtuAdu || !crc_ok(frame, orders_)) return std::nullopt;
    const ByteView pdu = pdu_of(frame);
    if (!answers(request_, pdu, byte_count_)) return std::nullopt;
    return Bytes(pdu.begin(), pdu.end());
}

std::optional<Bytes> ReplyFramer::accept(std::size_t start, Bytes pdu) {
    classify(ByteView(heard_).first(start));
    const std::size_t before = unused_.size();
    heard_ = classify_behind(ByteView(heard_).subspan(start + pdu.size() + kAduOverhead));
    behind_ = unused_.size() - before;
    inside_ = false;
    forget_starts();
    collect_starts();
    open_length_ = has_start();
    return pdu;
}

/// True if these bytes may be the beginning of another reply: of one with values its header is
/// known, of the confirmation of a write all that it repeats.
bool ReplyFramer::begins_like_reply(ByteView bytes) const {
    if (!expected_ || bytes.empty() || bytes.size() >= *expected_) return false;
    Bytes head{station_, request_[0]};
    if (is_read(request_[0])) {
        head.push_back(static_cast<std::uint8_t>(*expected_ - kReadReplyOverhead));
    } else if (is_broadcastable(request_[0])) {
        const Bytes reply = normal_write_reply(request_);
        head.insert(head.end(), reply.begin() + 1, reply.end());
    } else {
        return false;
    }
    const std::size_t size = std::min(head.size(), bytes.size());
    return std::ranges::equal(ByteView(head).first(size), bytes.first(size));
}

/// Returns what may be the beginning of another reply.
Bytes ReplyFramer::classify_behind(ByteView bytes) {
    Bytes begun;
    for (Unused& part : classify_heard(bytes, station_, orders_)) {
        if (part.kind == Unused::Kind::damaged && begins_like_reply(part.bytes)) {
            begun = std::move(part.bytes);
        } else {
            step_over(std::move(part));
        }
    }
    return begun;
}

Bytes ReplyFramer::take_pending() {
    forget_starts();
    open_length_ = false;
    return std::exchange(heard_, {});
}

/// Discards the first `count` received bytes.
void ReplyFramer::discard(std::size_t count) {
    classify(ByteView(heard_).first(count));
    heard_.erase(heard_.begin(), heard_.begin() + static_cast<std::ptrdiff_t>(count));
    forget_starts();
    open_length_ = false;
    if (ends_ == Ends::by_length) collect_starts();
}

// Received bytes that are no reply: their classification.

/// How many of these bytes may be the reply's: from the first that begin like it. 0: none.
std::size_t ReplyFramer::size_from_start(ByteView bytes) const {
    for (; bytes.size() > 1; bytes = bytes.subspan(1)) {
        if (is_start(bytes[0], bytes[1])) return bytes.size();
        if (ends_ == Ends::told) break;
    }
    return 0;
}

/// Returns distinct_byte_count() of the request; nothing where the reply may have any byte count.
std::optional<std::uint8_t> ReplyFramer::distinct_count() const {
    return expected_ ? distinct_byte_count(request_) : std::nullopt;
}

/// True for our damaged reply, and not for our own frame, which may begin like it.
bool ReplyFramer::is_own_reply(ByteView damaged) const {
    const auto count = distinct_count();
    return count && damaged.size() >= std::min(*expected_, kReadRequestAdu + 1) &&
           damaged[0] == station_ && damaged[1] == request_[0] && damaged[2] == *count;
}

/// Bytes of the beginning of our own frame, which no reply to the read has.
std::size_t ReplyFramer::own_beginning(ByteView damaged) const {
    if (!distinct_count()) return 0;
    const Bytes own = encode_adu(station_, request_, orders_.of(station_));
    const auto same = std::ranges::mismatch(damaged, own).in1 - damaged.begin();
    return std::cmp_less(same, kHeader) ? 0 : static_cast<std::size_t>(same);
}

bool ReplyFramer::ends_beheaded(ByteView damaged) const {
    if (ends_ == Ends::told || !expected_) return false;
    const bool writes = is_broadcastable(request_[0]);
    if (!writes && !is_read(request_[0])) return false;
    Bytes head{station_};
    const Bytes reply =
        writes ? normal_write_reply(request_)
               : Bytes{request_[0], static_cast<std::uint8_t>(*expected_ - kReadReplyOverhead)};
    head.insert(head.end(), reply.begin(), reply.begin() + kHeader - 1);
    for (std::size_t lost = 1; lost <= kHeader; ++lost) {
        const std::size_t rest = *expected_ - lost;
        if (rest > damaged.size()) continue;
        Bytes whole(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(lost));
        whole.insert(whole.end(), damaged.end() - static_cast<std::ptrdiff_t>(rest), damaged.end());
        if (crc_ok(whole, orders_) && answers(request_, pdu_of(whole))) return true;
    }
    return false;
}

void ReplyFramer::classify(ByteView bytes) {
    if (ends_ == Ends::told) {
        if (!bytes.empty()) step_over(classify_frame(bytes, station_, false));
        return;
    }
    for (Unused& part : classify_heard(bytes, station_, orders_)) step_over(std::move(part));
}

void ReplyFramer::step_over(Unused part) {
    if (part.kind == Unused::Kind::damaged) {
        const ByteView not_own = ByteView(part.bytes).subspan(own_beginning(part.bytes));
        const std::size_t size = size_from_start(not_own);
        damaged_ = damaged_ || size > 0;
        damaged_whole_ = damaged_whole_ || (size > 0 && size >= expected_.value_or(0));
        own_header_ = own_header_ || (size > 0 && is_own_reply(part.bytes));
    }
    constexpr std::size_t kKept = 64;  // parts; further bytes go to the last one
    if (unused_.size() < kKept) {
        unused_.push_back(std::move(part));
    } else if (unused_.back().bytes.size() < kMaxHeard) {
        unused_.back().bytes.insert(unused_.back().bytes.end(), part.bytes.begin(),
                                    part.bytes.end());
    }
}

Unused classify_frame(ByteView bytes, std::uint8_t own_station, bool good) {
    Unused part;
    part.bytes.assign(bytes.begin(), bytes.end());
    if (!good) return part;
    part.station = bytes[0];
    part.kind = bytes[0] == own_station ? Unused::Kind::own : Unused::Kind::foreign;
    return part;
}

namespace {

bool is_valid(ByteView bytes, std::size_t size, const CrcOrders& orders) {
    return size >= kMinAdu && size <= bytes.size() && size <= kMaxLongRtuAdu &&
           crc_ok(bytes.first(size), orders);
}

/// Bytes in front of the first valid frame that begins behind the first byte; without one all. A
/// request in front keeps the reply that follows it.
std::size_t size_of_damage(ByteView bytes, const CrcOrders& orders) {
    std::size_t size = request_adu_length(bytes);
    if (!is_valid(bytes, size, orders)) size = 1;
    const ByteView behind = bytes.subspan(size);
    const std::size_t reply = known_reply_length(behind);
    if (size > 1 && is_valid(behind, reply, orders)) return size + reply;
    for (; size + kMinAdu <= bytes.size(); ++size) {
        const ByteView rest = bytes.subspan(size);
        if (is_valid(rest, known_reply_length(rest), orders) ||
            is_valid(rest, request_adu_length(rest), orders))
            return size;
    }
    return bytes.size();
}

}  // namespace

std::vector<Unused> classify_heard(ByteView bytes, std::uint8_t own_station,
                                   const CrcOrders& orders) {
    std::vector<Unused> parts;
    while (!bytes.empty()) {
        std::size_t size = known_reply_length(bytes);
        bool good = is_valid(bytes, size, orders);
        if (!good) {
            good = is_valid(bytes, bytes.size(), orders);
            size = good ? bytes.size() : size_of_damage(bytes, orders);
        }
        parts.push_back(classify_frame(bytes.first(size), own_station, good));
        bytes = bytes.subspan(size);
    }
    return parts;
}

}  // namespace panelgate::modbus
