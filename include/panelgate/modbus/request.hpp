#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {

/// What a request reads and writes; nothing for functions without addresses.
struct Access {
    std::optional<Span> read;
    std::optional<Span> write;
};

/// How strictly quantities are judged before transmission (PDU-08).
enum class QuantityCheck {
    fit,   ///< the reply must fit a 253-byte PDU: what a TCP client can be given
    wide,  ///< REST and polls: up to 255 data bytes, the GT's larger frames
};

/// Is this PDU one that may be transmitted? Function 0 or 128..255: Fault::denied. A length that
/// contradicts the function (PDU-07) or a reply that cannot fit: Fault::malformed.
/// Unknown functions have no length rule and pass. An empty PDU is malformed.
Result<void> check_request(ByteView pdu, QuantityCheck check = QuantityCheck::fit);

/// Which items a checked request touches.
Access access_of(ByteView pdu);
/// What this PDU asks for, when it is a read of a table: 01..04, at least one item, none beyond the
/// end of the table.
std::optional<Span> read_span(ByteView pdu);
/// Repeating it cannot change anything (RTY-02): the reads, and 2B/0E.
bool is_pure_read(ByteView pdu);
/// 08/0004 Force Listen Only Mode: a unicast request that is never answered (DIA-01).
bool is_never_answered(ByteView pdu);

/// A request that may be transmitted, as check_request() says. What it is is found out once, when
/// it is made, and there is no other way to make one: whoever is handed one need not check it. A
/// value; of one that was moved from nothing may be asked.
class Request {
  public:
    static Result<Request> make(Bytes pdu, QuantityCheck check);
    /// Of at least one item, none beyond the end of the table, no more than a wide reply holds.
    static Request read(const Span& span);

    const Bytes& pdu() const { return pdu_; }
    std::uint8_t function() const { return pdu_[0]; }
    /// Repeating it cannot change anything (RTY-02).
    bool is_read() const { return read_; }
    bool is_broadcastable() const { return modbus::is_broadcastable(function()); }
    /// A unicast request that is never answered (DIA-01).
    bool is_never_answered() const { return modbus::is_never_answered(pdu_); }
    /// What read_span() says: nothing unless it is a read of one table.
    const std::optional<Span>& span() const { return span_; }
    /// Which items it reads and writes.
    Access access() const { return access_of(pdu_); }
    /// Lq: as reply_length_from_request() says.
    std::optional<std::size_t> reply_length() const { return reply_length_; }
    friend bool operator==(const Request& a, const Request& b) { return a.pdu_ == b.pdu_; }

  private:
    explicit Request(Bytes pdu);

    Bytes pdu_;
    bool read_;
    std::optional<Span> span_;
    std::optional<std::size_t> reply_length_;
};

/// Length of the request ADU (address to CRC) that begins here, where its function and byte count
/// tell it: 01 to 06, 0F and 10. 0: nothing tells, or too little is there to tell.
std::size_t request_adu_length(ByteView heard);

/// Length of the normal RTU reply (address to CRC) when the request tells it;
/// 0 for 08/0004; nothing when only the reply tells.
std::optional<std::size_t> reply_length_from_request(ByteView pdu);

Bytes encode_read(Table table, std::uint16_t address, std::uint16_t count);
/// `span` is what read_span() may give.
Bytes encode_read(const Span& span);
Bytes encode_write_coil(std::uint16_t address, bool value);
Bytes encode_write_register(std::uint16_t address, std::uint16_t value);
/// At most 2040 coils (255 data bytes); more breaks the caller's contract.
Bytes encode_write_coils(std::uint16_t address, const std::vector<bool>& values);
/// At most 127 registers.
Bytes encode_write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values);

/// Bits packed least significant first, unused high bits zero (PDU-06).
Bytes pack_bits(const std::vector<bool>& values);

/// Could writing `written` change what a read of `items` gives? Other tables may show the same
/// memory (Autonics UB and UW), and a write without addresses (nothing) may change anything.
inline bool may_change(const std::optional<Span>& written, const Span& items) {
    return !written || written->table != items.table || written->overlaps(items);
}

}  // namespace panelgate::modbus
