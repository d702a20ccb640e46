#include "panelgate/modbus/request.hpp"

#include <cassert>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::modbus {

namespace {

constexpr std::size_t kFileReference = 7;                    // type, file, record, length
constexpr std::uint16_t kLoopback = 0;                       // 08/0000 Return Query Data
constexpr std::uint16_t kListenOnly = 4;                     // 08/0004 Force Listen Only Mode
[[maybe_unused]] constexpr std::size_t kMaxByteCount = 255;  // one byte

std::size_t bytes_for_bits(std::size_t bits) { return (bits + 7) / 8; }

/// The 16-bit field at `offset`; 0 where the PDU ends before it.
std::uint16_t field(ByteView pdu, std::size_t offset) {
    Reader in(pdu);
    in.take(offset);
    return in.u16();
}

/// 0F and 10: the byte count at offset 5 must match the data and the quantity.
bool is_multiple_write(ByteView pdu, std::size_t data_size) {
    constexpr std::size_t kHeader = 6;
    return pdu.size() >= kHeader && pdu[kHeader - 1] == data_size &&
           pdu.size() == kHeader + data_size;
}

bool is_read_write(ByteView pdu) {
    constexpr std::size_t kHeader = 10;
    const std::size_t data_size = std::size_t{2} * field(pdu, 7);
    return pdu.size() >= kHeader && pdu[kHeader - 1] == data_size &&
           pdu.size() == kHeader + data_size;
}

bool is_file_read(ByteView pdu) {
    return pdu.size() >= 2 && pdu.size() == 2u + pdu[1] && pdu[1] % kFileReference == 0;
}

/// 15h: the sub-requests add up to the byte count exactly.
bool is_file_write(ByteView pdu) {
    if (pdu.size() < 2 || pdu.size() != 2u + pdu[1]) return false;
    Reader in(pdu.subspan(2));
    while (in.ok() && in.left() > 0) {
        in.take(kFileReference - 2);
        const std::uint16_t registers = in.u16();
        in.take(std::size_t{2} * registers);
    }
    return in.finished();
}

/// 08: a sub-function and at least one data word.
bool is_diagnostics(ByteView pdu) { return pdu.size() >= 5 && pdu.size() % 2 == 1; }

bool is_encapsulated(ByteView pdu) {
    return pdu.size() >= 2 && (pdu[1] != kMeiDeviceIdentification || pdu.size() == 4);
}

/// Request lengths (PDU-07). Functions without a case have no rule.
bool length_matches(ByteView pdu) {
    switch (pdu[0]) {
        case kReadCoils:
        case kReadDiscreteInputs:
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kWriteSingleCoil:
        case kWriteSingleRegister:
            return pdu.size() == 5;
        case kReadExceptionStatus:
        case kGetCommEventCounter:
        case kGetCommEventLog:
        case kReportServerId:
            return pdu.size() == 1;
        case kDiagnostics:
            return is_diagnostics(pdu);
        case kWriteMultipleCoils:
            return is_multiple_write(pdu, bytes_for_bits(field(pdu, 3)));
        case kWriteMultipleRegisters:
            return is_multiple_write(pdu, std::size_t{2} * field(pdu, 3));
        case kReadFileRecord:
            return is_file_read(pdu);
        case kWriteFileRecord:
            return is_file_write(pdu);
        case kMaskWriteRegister:
            return pdu.size() == 7;
        case kReadWriteMultipleRegisters:
            return is_read_write(pdu);
        case kReadFifoQueue:
            return pdu.size() == 3;
        case kEncapsulatedInterface:
            return is_encapsulated(pdu);
        default:
            return true;
    }
}

struct Limits {
    std::size_t request_pdu;
    std::size_t reply_adu;
};

Limits limits_of(QuantityCheck check) {
    switch (check) {
        case QuantityCheck::fit:
            return {kMaxPdu, kMaxRtuAdu};
        case QuantityCheck::wide:
            return {kMaxLongRequestPdu, kMaxLongRtuAdu};
    }
    std::abort();
}

/// Data size of the reply to 14h: a length byte, a type byte and 2N data bytes per sub-request.
std::size_t file_reply_size(ByteView pdu) {
    Reader in(pdu);
    in.take(2);
    std::size_t size = 0;
    while (in.left() >= kFileReference) {
        in.take(kFileReference - 2);
        size += 2 + std::size_t{2} * in.u16();
    }
    return size;
}

}  // namespace

Result<void> check_request(ByteView pdu, QuantityCheck check) {
    if (pdu.empty()) return Fault::malformed;
    if (pdu[0] == 0 || (pdu[0] & kExceptionBit) != 0) return Fault::denied;
    const Limits limits = limits_of(check);
    if (pdu.size() > limits.request_pdu || !length_matches(pdu)) return Fault::malformed;
    if (reply_length_from_request(pdu).value_or(0) > limits.reply_adu) return Fault::malformed;
    return {};
}

Access access_of(ByteView pdu) {
    const std::uint8_t function = pdu.empty() ? std::uint8_t{0} : pdu[0];
    const std::uint16_t address = field(pdu, 1);
    const std::uint16_t count = field(pdu, 3);
    const auto items = [](Table table, std::uint16_t at, std::uint16_t n) {
        return std::optional<Span>(Span{table, at, n});
    };
    switch (function) {
        case kReadCoils:
            return {items(Table::coils, address, count), {}};
        case kReadDiscreteInputs:
            return {items(Table::discrete_inputs, address, count), {}};
        case kReadHoldingRegisters:
            return {items(Table::holding_registers, address, count), {}};
        case kReadInputRegisters:
            return {items(Table::input_registers, address, count), {}};
        case kReadFifoQueue:
            return {items(Table::holding_registers, address, 1), {}};
        case kWriteSingleCoil:
            return {{}, items(Table::coils, address, 1)};
        case kWriteMultipleCoils:
            return {{}, items(Table::coils, address, count)};
        case kWriteSingleRegister:
        case kMaskWriteRegister:
            return {{}, items(Table::holding_registers, address, 1)};
        case kWriteMultipleRegisters:
            return {{}, items(Table::holding_registers, address, count)};
        case kReadWriteMultipleRegisters:
            return {items(Table::holding_registers, address, count),
                    items(Table::holding_registers, field(pdu, 5), field(pdu, 7))};
        default:
            return {};
    }
}

std::optional<Span> read_span(ByteView pdu) {
    constexpr std::size_t kSize = kReadRequestAdu - kAduOverhead;
    if (pdu.size() != kSize || !reads_table(pdu[0])) return std::nullopt;
    const std::optional<Span> span = access_of(pdu).read;
    if (span->count == 0 || span->end() > kTableItems) return std::nullopt;
    return span;
}

bool is_pure_read(ByteView pdu) {
    if (pdu.empty()) return false;
    if (pdu[0] != kEncapsulatedInterface) return is_read(pdu[0]);
    return pdu.size() >= 2 && pdu[1] == kMeiDeviceIdentification;
}

bool returns_values(ByteView pdu) {
    return is_pure_read(pdu) || (!pdu.empty() && pdu[0] == kReadWriteMultipleRegisters);
}

bool is_never_answered(ByteView pdu) {
    return pdu.size() >= 3 && pdu[0] == kDiagnostics && field(pdu, 1) == kListenOnly;
}

Request::Request(Bytes pdu)
    : pdu_(std::move(pdu)),
      read_(is_pure_read(pdu_)),
      span_(modbus::read_span(pdu_)),
      reply_length_(reply_length_from_request(pdu_)) {}

Request Request::with_any_length() const {
    Request same = *this;
    if (!reads_table(function())) return same;
    same.byte_count_ = ByteCount::any;
    same.span_.reset();
    same.reply_length_.reset();
    return same;
}

Result<Request> Request::make(Bytes pdu, QuantityCheck check) {
    if (const auto legal = check_request(pdu, check); !legal) return legal.error();
    return Request(std::move(pdu));
}

Request Request::read(const Span& span) {
    Request request(encode_read(span));
    assert(request.span_ == span);
    return request;
}

std::size_t request_adu_length(ByteView heard) {
    constexpr std::size_t kByteCount = 6;
    if (heard.size() <= kByteCount) return 0;
    const std::uint8_t function = heard[1];
    const bool one = function >= kReadCoils && function <= kWriteSingleRegister;
    const bool many = function == kWriteMultipleCoils || function == kWriteMultipleRegisters;
    return one || many ? request_length(heard).length : 0;
}

std::optional<std::size_t> reply_length_from_request(ByteView pdu, ByteCount byte_count) {
    if (pdu.empty()) return std::nullopt;
    if (byte_count == ByteCount::any && reads_table(pdu[0])) return std::nullopt;
    switch (pdu[0]) {
        case kReadCoils:
        case kReadDiscreteInputs:
            return kReadReplyOverhead + bytes_for_bits(field(pdu, 3));
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kReadWriteMultipleRegisters:
            return kReadReplyOverhead + std::size_t{2} * field(pdu, 3);
        case kWriteSingleCoil:
        case kWriteSingleRegister:
        case kGetCommEventCounter:
        case kWriteMultipleCoils:
        case kWriteMultipleRegisters:
            return 8;
        case kReadExceptionStatus:
            return 5;
        case kDiagnostics:
            if (is_never_answered(pdu)) return 0;
            return field(pdu, 1) == kLoopback ? pdu.size() + kAduOverhead : 8;
        case kReadFileRecord:
            return 5 + file_reply_size(pdu);
        case kWriteFileRecord:
            return pdu.size() + kAduOverhead;
        case kMaskWriteRegister:
            return 10;
        default:
            return std::nullopt;
    }
}

std::optional<std::uint8_t> distinct_byte_count(ByteView request) {
    const auto length = reply_length_from_request(request);
    if (!length || request.size() < 2 || !is_read(request[0])) return std::nullopt;
    const auto count = static_cast<std::uint8_t>(*length - kReadReplyOverhead);
    return request[1] == count ? std::nullopt : std::optional(count);
}

Bytes encode_read(Table table, std::uint16_t address, std::uint16_t count) {
    Writer out;
    out.u8(read_function(table)).u16(address).u16(count);
    return out.take();
}

Bytes encode_read(const Span& span) {
    return encode_read(span.table, static_cast<std::uint16_t>(span.first),
                       static_cast<std::uint16_t>(span.count));
}

Bytes encode_write_coil(std::uint16_t address, bool value) {
    Writer out;
    out.u8(kWriteSingleCoil).u16(address).u16(value ? 0xFF00 : 0x0000);
    return out.take();
}

Bytes encode_write_register(std::uint16_t address, std::uint16_t value) {
    Writer out;
    out.u8(kWriteSingleRegister).u16(address).u16(value);
    return out.take();
}

Bytes encode_write_coils(std::uint16_t address, const std::vector<bool>& values) {
    const Bytes data = pack_bits(values);
    assert(data.size() <= kMaxByteCount);
    Writer out;
    out.u8(kWriteMultipleCoils).u16(address).u16(static_cast<unsigned>(values.size()));
    out.u8(static_cast<unsigned>(data.size())).raw(data);
    return out.take();
}

Bytes encode_write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values) {
    assert(2 * values.size() <= kMaxByteCount);
    Writer out;
    out.u8(kWriteMultipleRegisters).u16(address).u16(static_cast<unsigned>(values.size()));
    out.u8(static_cast<unsigned>(2 * values.size()));
    for (const std::uint16_t value : values) out.u16(value);
    return out.take();
}

Bytes pack_bits(const std::vector<bool>& values) {
    Bytes packed(bytes_for_bits(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (values[i]) packed[i / 8] = static_cast<std::uint8_t>(packed[i / 8] | 1u << (i % 8));
    }
    return packed;
}

}  // namespace panelgate::modbus
