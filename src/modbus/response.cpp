#include "panelgate/modbus/response.hpp"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

namespace {

constexpr std::size_t kAddressAndCount = 5;  // function, address, quantity

/// True for function, byte count and exactly as many bytes.
bool has_true_byte_count(ByteView reply) {
    return reply.size() >= 2 && reply.size() == 2u + reply[1];
}

/// True if the reply is the first `size` bytes of the request.
bool repeats(ByteView request, ByteView reply, std::size_t size) {
    return request.size() >= size && reply.size() == size &&
           std::equal(reply.begin(), reply.end(), request.begin());
}

/// True if the reply has the length that the request determines (FRM-04).
bool has_expected_size(ByteView request, ByteView reply) {
    return reply_length_from_request(request) == reply.size() + kAduOverhead;
}

/// 08: the sub-function is echoed; 0000 returns the whole request.
bool answers_diagnostics(ByteView request, ByteView reply) {
    if (request.size() < 3 || !has_expected_size(request, reply)) return false;
    const bool loopback = request[1] == 0 && request[2] == 0;
    const std::size_t same = loopback ? request.size() : 3;
    return reply.size() >= same &&
           std::equal(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(same),
                      request.begin());
}

/// 14h: each group has the length and the reference type that its sub-request asked for.
bool answers_file_read(ByteView request, ByteView reply) {
    if (!has_true_byte_count(reply) || !has_expected_size(request, reply)) return false;
    Reader asked(request.subspan(2));
    Reader given(reply.subspan(2));
    while (asked.ok() && asked.left() > 0) {
        const std::uint8_t type = asked.u8();
        asked.take(4);  // file and record
        const std::size_t data = std::size_t{2} * asked.u16();
        if (given.u8() != data + 1 || given.u8() != type) return false;
        given.take(data);
    }
    return asked.finished() && given.finished();
}

/// 18h: a byte count of two bytes, which covers the value count and the values.
bool is_fifo_reply(ByteView reply) {
    Reader in(reply);
    in.u8();
    const std::size_t byte_count = in.u16();
    const std::size_t values = in.u16();
    in.take(2 * values);
    return in.finished() && byte_count == 2 + 2 * values;
}

/// 2B: the MEI type is echoed; with 0E also the code, in a header of 7 bytes. The objects are not
/// parsed: panels miscount them (FRM-10). With code 04 there is one, the one that was asked for.
bool answers_encapsulated(ByteView request, ByteView reply) {
    if (request.size() < 2 || reply.size() < 2 || reply[1] != request[1]) return false;
    if (request[1] != kMeiDeviceIdentification) return true;
    if (reply.size() < 7 || request.size() < 4 || reply[2] != request[2]) return false;
    const bool is_individual = request[2] == 4 && reply.size() > 7;
    return !is_individual || reply[7] == request[3];
}

}  // namespace

bool answers(ByteView request, ByteView reply, ByteCount byte_count) {
    if (request.empty() || reply.empty()) return false;
    if (reply[0] == (request[0] | kExceptionBit)) return exception_of(reply).has_value();
    if (reply[0] != request[0]) return false;
    if (byte_count == ByteCount::any && reads_table(request[0]))
        return has_true_byte_count(reply) && reply[1] > 0 && reply.size() <= kMaxPdu;
    switch (request[0]) {
        case kReadCoils:
        case kReadDiscreteInputs:
        case kReadHoldingRegisters:
        case kReadInputRegisters:
        case kReadWriteMultipleRegisters:
            return has_true_byte_count(reply) && has_expected_size(request, reply);
        case kWriteSingleCoil:
        case kWriteSingleRegister:
        case kWriteFileRecord:
        case kMaskWriteRegister:
            return repeats(request, reply, request.size());
        case kWriteMultipleCoils:
        case kWriteMultipleRegisters:
            return repeats(request, reply, kAddressAndCount);
        case kReadExceptionStatus:
        case kGetCommEventCounter:
            return has_expected_size(request, reply);
        case kDiagnostics:
            return answers_diagnostics(request, reply);
        case kGetCommEventLog:
        case kReportServerId:
            return has_true_byte_count(reply);
        case kReadFileRecord:
            return answers_file_read(request, reply);
        case kReadFifoQueue:
            return is_fifo_reply(reply);
        case kEncapsulatedInterface:
            return answers_encapsulated(request, reply);
        default:
            return true;
    }
}

Bytes normal_write_reply(ByteView request) {
    assert(!request.empty() && is_broadcastable(request[0]) && request.size() >= kAddressAndCount);
    const ByteView reply = request.first(std::min(request.size(), kAddressAndCount));
    return Bytes(reply.begin(), reply.end());
}

std::vector<std::uint16_t> registers_of(ByteView reply) {
    Reader in(reply);
    in.take(2);  // function and byte count
    std::vector<std::uint16_t> registers;
    registers.reserve(in.left() / 2);
    while (in.left() >= 2) registers.push_back(in.u16());
    return registers;
}

std::vector<bool> bits_of(ByteView reply, std::size_t count) {
    constexpr std::size_t kHeader = 2;  // function and byte count
    std::vector<bool> bits(count);
    for (std::size_t i = 0; i < count && kHeader + i / 8 < reply.size(); ++i) {
        bits[i] = (reply[kHeader + i / 8] >> (i % 8) & 1) != 0;
    }
    return bits;
}

namespace {

/// The frame of 05 and 06: function, address, value (AP 6.5, 6.6).
struct SingleWrite {
    std::uint16_t address = 0;
    std::uint16_t value = 0;
};

SingleWrite single_write(const Bytes& pdu) {
    Reader in(pdu);
    in.u8();
    const std::uint16_t address = in.u16();
    return {address, in.u16()};
}

std::optional<Bytes> as_write_coils(const Bytes& pdu) {
    constexpr std::uint16_t kOn = 0xFF00;
    const SingleWrite write = single_write(pdu);
    if (write.value != kOn && write.value != 0) return std::nullopt;
    return encode_write_coils(write.address, {write.value == kOn});
}

Bytes as_write_registers(const Bytes& pdu) {
    const SingleWrite write = single_write(pdu);
    return encode_write_registers(write.address, {write.value});
}

std::optional<Bytes> with_other_function(const Bytes& pdu) {
    Bytes same = pdu;
    switch (pdu[0]) {
        case kWriteSingleCoil:
            return as_write_coils(pdu);
        case kWriteSingleRegister:
            return as_write_registers(pdu);
        case kReadDiscreteInputs:
            same[0] = kReadCoils;
            return same;
        case kReadInputRegisters:
            same[0] = kReadHoldingRegisters;
            return same;
        default:
            return std::nullopt;
    }
}

}  // namespace

std::optional<Request> translated(const Request& request) {
    auto pdu = with_other_function(request.pdu());
    if (!pdu) return std::nullopt;
    auto made = Request::make(std::move(*pdu), QuantityCheck::wide);
    if (!made) return std::nullopt;
    return std::move(*made);
}

Bytes translated_back(const Bytes& asked, ByteView reply) {
    assert(!asked.empty() && !reply.empty());
    const bool refused = exception_of(reply).has_value();
    if (!refused && is_broadcastable(asked[0])) return asked;  // 05 and 06 are echoed
    Bytes own(reply.begin(), reply.end());
    own[0] = refused ? static_cast<std::uint8_t>(asked[0] | kExceptionBit) : asked[0];
    return own;
}

}  // namespace panelgate::modbus
