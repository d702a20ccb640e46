#include "panelgate/modbus/rtu_request_framer.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {
namespace {

using Kind = RequestLength::Kind;

RequestLength known_length(std::size_t length) { return {Kind::known, length}; }

/// Returns `overhead` plus the value of the byte at `count`.
RequestLength counted(ByteView b, std::size_t count, std::size_t overhead) {
    return b.size() <= count ? RequestLength{} : known_length(overhead + b[count]);
}

bool is_frame(ByteView b) { return b.size() >= kMinAdu && b.size() <= kMaxRtuAdu && crc_ok(b); }

/// Size of the valid frame of known length that begins here; 0 if there is none.
std::size_t known_frame(ByteView b) {
    const RequestLength length = request_length(b);
    if (length.kind != Kind::known || length.length > b.size()) return 0;
    return is_frame(b.first(length.length)) ? length.length : 0;
}

/// True if it may be 08/0000 with one word of data, before its CRC is complete.
bool may_be_usual_diagnostics(ByteView b) {
    return b[1] == kDiagnostics && b.size() < kReadRequestAdu;
}

/// True for a function without a length rule, whose data may begin right after it.
bool may_hide_data(ByteView b) {
    if (b.size() < 2 || b[1] == 0 || (b[1] & kExceptionBit) != 0) return false;
    return request_length(b).kind == Kind::by_silence;
}

}  // namespace

RequestLength request_length(ByteView b) {
    if (b.size() < 2) return {};
    switch (b[1]) {
        case kReadCoils:
        case kReadDiscreteInputs:
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kWriteSingleCoil:
        case kWriteSingleRegister:
            return known_length(kReadRequestAdu);
        case kReadExceptionStatus:
        case kGetCommEventCounter:
        case kGetCommEventLog:
        case kReportServerId:
            return known_length(kMinAdu);
        case kDiagnostics:
            if (b.size() < 4) return {};
            return b[2] == 0 && b[3] == 0 ? RequestLength{Kind::by_silence, 0}
                                          : known_length(kReadRequestAdu);
        case kWriteMultipleCoils:
        case kWriteMultipleRegisters:
            return counted(b, 6, 9);
        case kReadFileRecord:
        case kWriteFileRecord:
            return counted(b, 2, 5);
        case kMaskWriteRegister:
            return known_length(10);
        case kReadWriteMultipleRegisters:
            return counted(b, 10, 13);
        case kReadFifoQueue:
            return known_length(6);
        case kEncapsulatedInterface:
            if (b.size() < 3) return {};
            return b[2] == kMeiDeviceIdentification ? known_length(7)
                                                    : RequestLength{Kind::by_silence, 0};
        default:
            return {Kind::by_silence, 0};
    }
}

RequestLength usual_request_length(ByteView frame) {
    constexpr std::size_t kUsual = kReadRequestAdu;
    const bool is_usual =
        frame.size() >= kUsual && frame[1] == kDiagnostics && crc_ok(frame.first(kUsual));
    return is_usual ? known_length(kUsual) : request_length(frame);
}

SerialAdu serial_adu_of(ByteView frame) {
    const ByteView pdu = pdu_of(frame);
    return {frame[0], Bytes(pdu.begin(), pdu.end())};
}

std::optional<SerialAdu> RtuRequestFramer::next() {
    if (ended_by_silence_ != 0) return take(std::exchange(ended_by_silence_, 0));
    while (!heard_.empty()) {
        const Judgement judgement = judge(heard_.view());
        if (judgement.kind == Judgement::Kind::open) break;
        if (judgement.kind == Judgement::Kind::nothing) {
            step_over(1);
        } else if (sure() || is_pure_read(pdu_of(heard_.view().first(judgement.size)))) {
            return take(judgement.size);
        } else {
            refuse(judgement.size);
        }
    }
    return std::nullopt;
}

RtuRequestFramer::Judgement RtuRequestFramer::judge(ByteView start) const {
    const RequestLength length = usual_request_length(start);
    if (length.kind == Kind::need_more) return {Judgement::Kind::open};
    if (length.kind == Kind::by_silence) {
        const bool may_be =
            (trusted_ && start.size() <= kMaxRtuAdu) || may_be_usual_diagnostics(start);
        return {may_be ? Judgement::Kind::open : Judgement::Kind::nothing};
    }
    if (length.length > kMaxRtuAdu) return {};
    if (length.length > start.size()) return {Judgement::Kind::open};
    if (!crc_ok(start.first(length.length))) return {};
    return {Judgement::Kind::frame, length.length};
}

void RtuRequestFramer::on_silence() {
    const bool was_lost = !trusted_;
    if (heard_.empty()) trust();
    ended_by_silence_ = size_by_silence();
    if (ended_by_silence_ != 0) return;
    for (std::size_t start = 1; start < heard_.size(); ++start) {
        if (known_frame(heard_.view().subspan(start)) == 0) continue;
        step_over(start);
        break;
    }
    // Pending bytes are left of a damaged frame, and the next frame begins after this silence; not
    // so if they are half a request, whose rest may follow the pause.
    if (was_lost && !trusted_ && bytes_to_silence_ == 0) bytes_to_silence_ = heard_.size();
}

/// Size of the frame at the front that only silence ends: it ends with the last byte, or where a
/// frame of known length begins. 0 if there is none.
std::size_t RtuRequestFramer::size_by_silence() const {
    const ByteView all = heard_.view();
    if (!trusted_) return 0;
    if (is_frame(all)) return all.size();
    if (request_length(all).kind != Kind::by_silence) return 0;
    for (std::size_t end = all.size(); end >= kMinAdu; --end) {
        if (is_frame(all.first(end)) && known_frame(all.subspan(end)) != 0) return end;
    }
    return 0;
}

SerialAdu RtuRequestFramer::take(std::size_t size) {
    SerialAdu adu = serial_adu_of(heard_.view().first(size));
    if (sure()) trust();
    discarded_ = 0;
    aligned_ = true;
    extend_run(size);
    return adu;
}

/// Rejects a valid frame that may be data.
void RtuRequestFramer::refuse(std::size_t size) {
    ++faults_;
    discarded_ += size;
    extend_run(size);
}

void RtuRequestFramer::step_over(std::size_t count) {
    if (std::exchange(aligned_, false)) ++faults_;
    if (trusted_) clear_trust();
    discarded_ += count;
    run_length_ = 0;
    consume(count);
}

void RtuRequestFramer::clear_trust() {
    constexpr std::size_t kGlitch = 3;  // of a transceiver that is switched
    trusted_ = false;
    since_lost_ = 0;
    run_length_ = 0;
    bytes_to_silence_ = 0;
    glitch_limit_ = may_hide_data(heard_.view()) ? 1 : kGlitch;
}

void RtuRequestFramer::trust() { aligned_ = trusted_ = true; }

void RtuRequestFramer::extend_run(std::size_t size) {
    consume(size);
    run_length_ += size;
    if (run_length_ > kMaxRtuAdu) trust();
}

void RtuRequestFramer::consume(std::size_t count) {
    heard_.take(count);
    since_lost_ += count;
    if (bytes_to_silence_ == 0) return;
    if (bytes_to_silence_ == count) trust();
    bytes_to_silence_ -= std::min(bytes_to_silence_, count);
}

void RtuRequestFramer::drop_pending() {
    ended_by_silence_ = 0;
    if (!heard_.empty()) step_over(heard_.size());
    trust();
}

std::size_t RtuRequestFramer::take_faults() { return std::exchange(faults_, 0); }

}  // namespace panelgate::modbus
