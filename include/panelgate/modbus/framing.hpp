#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// How an ADU stands in a stream.
enum class Framing : std::uint8_t {
    tcp,   ///< MBAP header (TG 3.1.3)
    rtu,   ///< address, PDU, CRC
    ascii  ///< ':', hex digits, LRC, CR LF
};
/// The word of the configuration.
std::string_view label(Framing framing);

/// Only MBAP has transaction ids; elsewhere the order says which reply is whose.
inline bool has_transactions(Framing framing) { return framing == Framing::tcp; }
/// Unit 0 of the serial modes is everybody, and nobody answers (SL 2.1).
inline bool is_answered(Framing framing, std::uint8_t unit) {
    return framing == Framing::tcp || unit != 0;
}
/// A whole reply, to be written at once. `pdu` has 1 to 253 bytes.
Bytes encode_reply(Framing framing, std::uint16_t transaction, std::uint8_t unit, ByteView pdu);

/// What else a client speaks who was expected to speak `expected`, by the first bytes that have
/// come, before any of them is taken: whole frames that fit by their check (CRC, LRC), or, of MBAP,
/// by the whole header. Nothing when that is not sure.
std::optional<Framing> other_framing(Framing expected, ByteView first);

}  // namespace panelgate::modbus
