#include "mbap.hpp"

#include <variant>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::line {

namespace {

/// A gateway's own 0A and 0B (AP V1.1b3, 7): no unit has answered, as on a serial line.
bool says_nobody_answered(ByteView pdu) {
    constexpr std::uint8_t kException = 0x80;
    constexpr std::uint8_t kPathUnavailable = 0x0A;
    constexpr std::uint8_t kNoResponse = 0x0B;
    return pdu.size() == 2 && (pdu[0] & kException) != 0 &&
           (pdu[1] == kPathUnavailable || pdu[1] == kNoResponse);
}

}  // namespace

Bytes Mbap::request(ByteView frame) {
    unit_ = frame[0];
    waits_ = unit_ != modbus::kBroadcast;
    return modbus::encode_mbap(++id_, unit_, modbus::pdu_of(frame));
}

std::optional<Bytes> Mbap::replies(ByteView received) {
    framer_.feed(received);
    Bytes frames;
    while (const auto event = framer_.next()) {
        if (std::holds_alternative<modbus::Broken>(*event)) return std::nullopt;
        const auto* adu = std::get_if<modbus::Adu>(&*event);
        if (adu == nullptr || !waits_ || adu->transaction != id_) continue;
        waits_ = adu->unit != unit_;
        if (says_nobody_answered(adu->pdu)) continue;
        const Bytes frame = modbus::encode_adu(adu->unit, adu->pdu);
        frames.insert(frames.end(), frame.begin(), frame.end());
    }
    return frames;
}

}  // namespace panelgate::line
