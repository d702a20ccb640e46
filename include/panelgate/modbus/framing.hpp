#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "panelgate/base/bytes.hpp"

namespace panelgate::modbus {

/// MBAP header (TG 3.1.3): transaction, protocol, length, then the unit, which length counts.
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
/// An ADU of another protocol (id not 0, legal length) was skipped; no reply (MBAP-06).
struct SkippedProtocol {
    friend bool operator==(const SkippedProtocol&, const SkippedProtocol&) = default;
};
/// Length outside 2..254: the start of the next ADU is unknown; close (MBAP-05).
struct Broken {
    friend bool operator==(const Broken&, const Broken&) = default;
};
using MbapEvent = std::variant<Adu, SkippedProtocol, Broken>;

/// Splits a TCP stream into ADUs by the length field, however it is segmented (MBAP-03). Call
/// next() until it returns std::nullopt before feeding more; then at most one unfinished ADU (259
/// bytes) is buffered. Linear time.
class MbapFramer {
  public:
    /// Bytes fed after a Broken are dropped.
    void feed(ByteView bytes);
    /// Returns the next event, or std::nullopt until more is fed. Broken is returned once, as the
    /// last.
    std::optional<MbapEvent> next();
    /// True if the next ADU has begun and is not complete (MBAP-07 limits for how long).
    bool partial() const;

  private:
    ByteQueue waiting_;
    bool broken_ = false;
};

/// Encodes a whole ADU, to be sent in one write (MBAP-04). `pdu` has 1 to 253 bytes.
Bytes encode_mbap(std::uint16_t transaction, std::uint8_t unit, ByteView pdu);

/// How an ADU is framed in a stream.
enum class Framing : std::uint8_t {
    tcp,   ///< MBAP header (TG 3.1.3)
    rtu,   ///< address, PDU, CRC
    ascii  ///< ':', hex digits, LRC, CR LF
};
/// Returns the configuration's word.
std::string_view label(Framing framing);

/// True for MBAP only: elsewhere the order assigns replies to requests.
inline bool has_transactions(Framing framing) { return framing == Framing::tcp; }
/// False for unit 0 of the serial modes: a broadcast gets no reply (SL 2.1).
inline bool is_answered(Framing framing, std::uint8_t unit) {
    return framing == Framing::tcp || unit != 0;
}
/// Encodes a whole reply, to be sent in one write. `pdu` has 1 to 253 bytes.
Bytes encode_reply(Framing framing, std::uint16_t transaction, std::uint8_t unit, ByteView pdu);

/// Detects a client that uses another framing than `expected`, from its first bytes, before any is
/// taken: whole frames with a valid check (CRC, LRC), or, for MBAP, a whole valid header.
/// std::nullopt if not certain.
std::optional<Framing> other_framing(Framing expected, ByteView first);

}  // namespace panelgate::modbus
