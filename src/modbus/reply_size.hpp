#pragma once

#include <cstddef>

#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::modbus {

/// Of the reply at the front. 0: that cannot be told yet, or only by silence.
inline std::size_t known_reply_length(ByteView heard) {
    const ReplyLength length = reply_length(heard);
    return length.kind == ReplyLength::Kind::known ? length.length : 0;
}

}  // namespace panelgate::modbus
