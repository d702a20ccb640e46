#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// The MBAP header (TG 3.1.3): transaction, protocol, length, then the unit, which length counts.
inline constexpr std::size_t kMbapPrefix = 6;       ///< bytes before the unit
inline constexpr std::size_t kMinMbapLength = 2;    ///< unit and function
inline constexpr std::size_t kMaxMbapLength = 254;  ///< unit and a PDU of 253 bytes
inline constexpr std::size_t kMaxTcpAdu = kMbapPrefix + kMaxMbapLength;  ///< 260 (AP 4.1)

struct Adu {
    std::uint16_t transaction = 0;
    std::uint8_t unit = 0;
    Bytes pdu;
    friend bool operator==(const Adu&, const Adu&) = default;
};
/// An ADU of another protocol (its id is not 0, its length is legal) went by; no reply (MBAP-06).
struct SkippedProtocol {
    friend bool operator==(const SkippedProtocol&, const SkippedProtocol&) = default;
};
/// A length outside 2..254: nobody knows where the next ADU starts; close (MBAP-05).
struct Broken {
    friend bool operator==(const Broken&, const Broken&) = default;
};
using MbapEvent = std::variant<Adu, SkippedProtocol, Broken>;

/// Cuts a TCP stream into ADUs by the length field, however it was split or glued (MBAP-03).
/// Holds what was fed and not yet taken: take with next() until it gives nothing before feeding
/// more, then it never holds more than one unfinished ADU (259 bytes). Work is linear in the bytes.
class MbapFramer {
  public:
    /// Bytes fed after a Broken are dropped.
    void feed(ByteView bytes);
    /// The next thing in the stream, or nothing until more is fed. Broken is told once, and is the
    /// last.
    std::optional<MbapEvent> next();
    /// The next ADU has begun and is not whole (MBAP-07 limits for how long).
    bool partial() const;

  private:
    ByteQueue waiting_;
    bool broken_ = false;
};

/// A whole ADU, to be written at once (MBAP-04). `pdu` has 1 to 253 bytes.
Bytes encode_mbap(std::uint16_t transaction, std::uint8_t unit, ByteView pdu);

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
