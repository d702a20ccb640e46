#include "panelgate/modbus/framing.hpp"

#include <cstddef>
#include <cstdlib>

#include "panelgate/modbus/ascii_frame.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/mbap.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::modbus {
namespace {

/// The first ADU of the stream is there, whole.
bool begins_with_mbap(ByteView first) {
    MbapFramer framer;
    framer.feed(first);
    const auto event = framer.next();
    return event && std::holds_alternative<Adu>(*event);
}

/// Size of the request at the front that nobody would send by accident; 0: there is none.
std::size_t rtu_request(ByteView bytes) {
    const RequestLength length = request_length(bytes);
    if (length.kind != RequestLength::Kind::known || length.length > bytes.size()) return 0;
    const auto frame = decode_adu(bytes.first(length.length));
    if (!frame || frame->station > kMaxStation || !check_request(frame->pdu)) return 0;
    const bool broadcast = frame->station == 0;
    return broadcast && !is_broadcastable(frame->pdu[0]) ? 0 : length.length;
}

/// Of a Modbus/TCP listener: a transaction id in 65536 would make the bytes of a good ADU fit a
/// CRC, so they are doubted only when they are nothing but RTU, or no ADU.
bool speaks_rtu(Framing expected, ByteView first) {
    std::size_t taken = 0;
    while (const std::size_t size = rtu_request(first.subspan(taken))) taken += size;
    if (taken == 0) return false;
    return expected != Framing::tcp || taken == first.size() || !begins_with_mbap(first);
}

/// Nothing but whole requests that somebody would send.
bool is_mbap(ByteView first) {
    MbapFramer framer;
    framer.feed(first);
    bool any = false;
    while (const auto event = framer.next()) {
        const Adu* adu = std::get_if<Adu>(&*event);
        any = adu != nullptr && is_known(adu->pdu[0]) && check_request(adu->pdu);
        if (!any) return false;
    }
    return any && !framer.partial();
}

/// Bytes that may still become a request in RTU are left alone.
bool speaks_tcp(Framing expected, ByteView first) {
    if (!is_mbap(first)) return false;
    if (expected != Framing::rtu) return true;
    const RequestLength length = request_length(first);
    return length.length <= first.size() && rtu_request(first) == 0 && !crc_ok(first);
}

bool speaks_ascii(ByteView first) {
    if (first[0] != ':') return false;
    AsciiFramer framer(HexDigits::any_case);
    framer.feed({}, first);
    return framer.next().has_value();
}

}  // namespace

std::string_view label(Framing framing) {
    switch (framing) {
        case Framing::tcp:
            return "tcp";
        case Framing::rtu:
            return "rtu";
        case Framing::ascii:
            return "ascii";
    }
    std::abort();
}

Bytes encode_reply(Framing framing, std::uint16_t transaction, std::uint8_t unit, ByteView pdu) {
    switch (framing) {
        case Framing::tcp:
            return encode_mbap(transaction, unit, pdu);
        case Framing::rtu:
            return encode_adu(unit, pdu);
        case Framing::ascii:
            return encode_ascii(unit, pdu);
    }
    std::abort();
}

std::optional<Framing> other_framing(Framing expected, ByteView first) {
    if (first.empty()) return std::nullopt;
    if (expected != Framing::rtu && speaks_rtu(expected, first)) return Framing::rtu;
    if (expected != Framing::ascii && speaks_ascii(first)) return Framing::ascii;
    if (expected != Framing::tcp && speaks_tcp(expected, first)) return Framing::tcp;
    return std::nullopt;
}

}  // namespace panelgate::modbus
