#pragma once

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/tap/cutter.hpp"

namespace panelgate::tap {

/// Of a good frame.
inline ByteView pdu_of(const Piece& piece) { return modbus::pdu_of(piece.bytes); }

/// True for a read of a table: its values are shown.
inline bool is_read(ByteView pdu) { return pdu[0] <= modbus::kReadInputRegisters; }

}  // namespace panelgate::tap
