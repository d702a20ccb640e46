#include "mbap.hpp"

#include <variant>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::line {

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
        const Bytes frame = modbus::encode_adu(adu->unit, adu->pdu);
        frames.insert(frames.end(), frame.begin(), frame.end());
    }
    return frames;
}

}  // namespace panelgate::line
