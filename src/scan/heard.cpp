#include "heard.hpp"

#include <array>
#include <optional>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
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

/// The good frame at the front.
std::optional<Found> frame_in_front(ByteView bytes) {
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

Heard take_apart(ByteView bytes) {
    Heard heard;
    while (!bytes.empty()) {
        const auto found = frame_in_front(bytes);
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

}  // namespace panelgate::scan
