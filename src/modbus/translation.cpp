#include "panelgate/modbus/translation.hpp"

#include <cassert>
#include <cstdint>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {
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

std::optional<Bytes> coil_by_coils(const Bytes& pdu) {
    constexpr std::uint16_t kOn = 0xFF00;
    const SingleWrite write = single_write(pdu);
    if (write.value != kOn && write.value != 0) return std::nullopt;
    return encode_write_coils(write.address, {write.value == kOn});
}

Bytes register_by_registers(const Bytes& pdu) {
    const SingleWrite write = single_write(pdu);
    return encode_write_registers(write.address, {write.value});
}

std::optional<Bytes> by_other_function(const Bytes& pdu) {
    Bytes same = pdu;
    switch (pdu[0]) {
        case kWriteSingleCoil:
            return coil_by_coils(pdu);
        case kWriteSingleRegister:
            return register_by_registers(pdu);
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
    auto pdu = by_other_function(request.pdu());
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
