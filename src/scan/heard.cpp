#include "heard.hpp"

#include <array>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::scan {
namespace {

constexpr std::size_t kFixedRequest = 8;  // AP 6.1 to 6.6: address, function, two words, CRC
constexpr std::size_t kAroundPdu = 3;

bool is_plausible(ByteView bytes) {
    const auto function = static_cast<std::uint8_t>(bytes[1] & ~modbus::kExceptionBit);
    if (bytes[0] > modbus::kMaxStation || !modbus::is_known(function)) return false;
    return bytes[0] != 0 || modbus::is_broadcastable(bytes[1]);
}

/// Length of the good frame at the front, 0 = none.
std::size_t frame_length(ByteView bytes) {
    constexpr std::size_t kMinAdu = 4;
    if (bytes.size() < kMinAdu || !is_plausible(bytes)) return 0;
    const modbus::ReplyLength reply = modbus::reply_length(bytes);
    const bool known = reply.kind == modbus::ReplyLength::Kind::known;
    for (const std::size_t length : std::array<std::size_t, 3>{
             known ? reply.length : 0, kFixedRequest, modbus::request_adu_length(bytes)}) {
        if (length >= kMinAdu && length <= bytes.size() && modbus::crc_ok(bytes.first(length)))
            return length;
    }
    return 0;
}

}  // namespace

Heard take_apart(ByteView bytes) {
    Heard heard;
    while (!bytes.empty()) {
        const std::size_t length = frame_length(bytes);
        if (length == 0) {
            ++heard.damaged;
            bytes = bytes.subspan(1);
            continue;
        }
        const ByteView pdu = bytes.subspan(1, length - kAroundPdu);
        heard.frames.push_back({bytes[0], Bytes(pdu.begin(), pdu.end())});
        bytes = bytes.subspan(length);
    }
    return heard;
}

}  // namespace panelgate::scan
