#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {

/// Items that a request reads and writes; none for functions without addresses.
struct Access {
    std::optional<Span> read;
    std::optional<Span> write;
};

/// How strictly quantities are checked before transmission (PDU-08).
enum class QuantityCheck {
    fit,   ///< the reply must fit a 253-byte PDU, as for a TCP client
    wide,  ///< REST and polls: up to 255 data bytes, the GT's larger frames
};

/// How the byte count of a normal reply to a read of a table (01 to 04) is judged.
enum class ByteCount : std::uint8_t {
    as_asked,  ///< the quantity asked decides
    /// The reply's own byte count decides. Devices with registers of 4 or 12 bytes (pymodbus#669,
    /// libmodbus#466, NModbus4#80).
    any,
};

/// Checks whether this PDU may be transmitted. Function 0 or 128..255: Fault::denied. A length that
/// contradicts the function (PDU-07) or a reply that cannot fit: Fault::malformed. Unknown
/// functions have no length rule and pass. An empty PDU is malformed.
Result<void> check_request(ByteView pdu, QuantityCheck check = QuantityCheck::fit);

/// Returns the items that a checked request reads and writes.
Access access_of(ByteView pdu);
/// Returns the span if this PDU is a read of a table: 01..04, at least one item, none beyond the
/// end of the table.
std::optional<Span> read_span(ByteView pdu);
/// True if repeating it cannot change anything (RTY-02): the reads, and 2B/0E.
bool is_pure_read(ByteView pdu);
/// True if its normal reply holds values: the pure reads, and 17h, which writes first.
bool returns_values(ByteView pdu);
/// True for 08/0004 Force Listen Only Mode: a unicast request that gets no reply (DIA-01).
bool is_never_answered(ByteView pdu);

/// A request that passed check_request(). Its properties are computed once, when it is made, and
/// only make() and read() make one: so it need not be checked again. A value; do not use one that
/// was moved from.
class Request {
  public:
    static Result<Request> make(Bytes pdu, QuantityCheck check);
    /// Makes a read of at least one item, none beyond the end of the table, no more than a wide
    /// reply holds.
    static Request read(const Span& span);
    /// Returns this request with ByteCount::any if it reads a table, otherwise unchanged. With
    /// ByteCount::any nobody knows which items a reply holds: such a request has no span(), so that
    /// its reply is not shared, cut or remembered, and no reply_length().
    Request with_any_length() const;

    const Bytes& pdu() const { return pdu_; }
    std::uint8_t function() const { return pdu_[0]; }
    /// True if repeating it cannot change anything (RTY-02).
    bool is_read() const { return read_; }
    bool is_broadcastable() const { return modbus::is_broadcastable(function()); }
    /// True for a unicast request that gets no reply (DIA-01).
    bool is_never_answered() const { return modbus::is_never_answered(pdu_); }
    /// Returns how the byte count of a reply is judged.
    ByteCount byte_count() const { return byte_count_; }
    /// Returns read_span() of the PDU: std::nullopt unless it is a read of one table with
    /// ByteCount::as_asked.
    const std::optional<Span>& span() const { return span_; }
    /// Returns the items that it reads and writes.
    Access access() const { return access_of(pdu_); }
    /// Lq: returns reply_length_from_request() of the PDU.
    std::optional<std::size_t> reply_length() const { return reply_length_; }
    friend bool operator==(const Request& a, const Request& b) {
        return a.pdu_ == b.pdu_ && a.byte_count_ == b.byte_count_;
    }

  private:
    explicit Request(Bytes pdu);

    Bytes pdu_;
    bool read_;
    ByteCount byte_count_ = ByteCount::as_asked;
    std::optional<Span> span_;
    std::optional<std::size_t> reply_length_;
};

/// Length of the request ADU (address to CRC) that begins here, if its function and byte count
/// determine it: 01 to 06, 0F and 10. 0: not determined, or too few bytes.
std::size_t request_adu_length(ByteView heard);

/// Length of the normal RTU reply (address to CRC) if the request determines it; 0 for 08/0004;
/// std::nullopt if only the reply determines it, as with ByteCount::any for 01 to 04.
std::optional<std::size_t> reply_length_from_request(ByteView pdu,
                                                     ByteCount byte_count = ByteCount::as_asked);

/// The byte count of the normal reply to this read, where the request has another byte in that
/// place: by it one frame's beginning is told from the other's. Empty: it tells nothing.
std::optional<std::uint8_t> distinct_byte_count(ByteView request);

Bytes encode_read(Table table, std::uint16_t address, std::uint16_t count);
/// `span` must be a valid result of read_span().
Bytes encode_read(const Span& span);
Bytes encode_write_coil(std::uint16_t address, bool value);
Bytes encode_write_register(std::uint16_t address, std::uint16_t value);
/// At most 2040 coils (255 data bytes); more breaks the caller's contract.
Bytes encode_write_coils(std::uint16_t address, const std::vector<bool>& values);
/// At most 127 registers.
Bytes encode_write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values);

/// Packs bits least significant first, unused high bits zero (PDU-06).
Bytes pack_bits(const std::vector<bool>& values);

/// True if writing `written` may change what a read of `items` returns. Other tables may show the
/// same memory (Autonics UB and UW), and a write without addresses (std::nullopt) may change
/// anything.
inline bool may_change(const std::optional<Span>& written, const Span& items) {
    return !written || written->table != items.table || written->overlaps(items);
}

}  // namespace panelgate::modbus
