#pragma once

#include <cstddef>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::test {

/// The good reply to a good request frame: registers that count, and writes that succeed.
inline Bytes reply_to(ByteView adu) {
    const ByteView pdu = adu.subspan(1, adu.size() - modbus::kAduOverhead);
    if (!modbus::is_read(pdu[0])) return modbus::encode_adu(adu[0], pdu.first(5));
    const unsigned count = pdu[3] * 256u + pdu[4];
    Writer reply;
    reply.u8(pdu[0]).u8(2 * count);
    static unsigned value = 0;
    for (unsigned i = 0; i < count; ++i) reply.u16(++value & 0xFFFF);
    return modbus::encode_adu(adu[0], reply.take());
}

}  // namespace panelgate::test
