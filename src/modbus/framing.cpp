#include "panelgate/modbus/framing.hpp"

#include <cstddef>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::modbus {

namespace {

struct Prefix {
    std::uint16_t transaction = 0;
    std::uint16_t protocol = 0;
    std::uint16_t length = 0;
};

std::optional<Prefix> read_prefix(ByteView bytes) {
    Reader in(bytes);
    Prefix prefix;
    prefix.transaction = in.u16();
    prefix.protocol = in.u16();
    prefix.length = in.u16();
    if (!in.ok()) return std::nullopt;
    return prefix;
}

bool is_legal(std::size_t length) { return length >= kMinMbapLength && length <= kMaxMbapLength; }

}  // namespace

void MbapFramer::feed(ByteView bytes) {
    if (!broken_) waiting_.feed(bytes);
}

std::optional<MbapEvent> MbapFramer::next() {
    const std::optional<Prefix> prefix = read_prefix(waiting_.view());
    if (!prefix) return std::nullopt;
    if (!is_legal(prefix->length)) {
        broken_ = true;
        waiting_.take(waiting_.size());
        return MbapEvent(Broken{});
    }
    const std::size_t size = kMbapPrefix + prefix->length;
    if (waiting_.size() < size) return std::nullopt;
    if (prefix->protocol != 0) {
        waiting_.take(size);
        return MbapEvent(SkippedProtocol{});
    }
    const ByteView body = waiting_.view().subspan(kMbapPrefix, prefix->length);
    const ByteView pdu = body.subspan(1);
    Adu adu;
    adu.transaction = prefix->transaction;
    adu.unit = body[0];
    adu.pdu.assign(pdu.begin(), pdu.end());
    waiting_.take(size);
    return MbapEvent(std::move(adu));
}

bool MbapFramer::partial() const {
    if (waiting_.empty()) return false;
    const std::optional<Prefix> prefix = read_prefix(waiting_.view());
    return !prefix || (is_legal(prefix->length) && waiting_.size() < kMbapPrefix + prefix->length);
}

Bytes encode_mbap(std::uint16_t transaction, std::uint8_t unit, ByteView pdu) {
    Writer out(kMbapPrefix + 1 + pdu.size());
    out.u16(transaction).u16(0).u16(static_cast<unsigned>(pdu.size() + 1)).u8(unit).raw(pdu);
    return out.take();
}

namespace {

/// True if the stream begins with a whole ADU.
bool begins_with_mbap(ByteView first) {
    MbapFramer framer;
    framer.feed(first);
    const auto event = framer.next();
    return event && std::holds_alternative<Adu>(*event);
}

/// Size of the plausible request at the front; 0 if there is none.
std::size_t rtu_request(ByteView bytes) {
    const RequestLength length = request_length(bytes);
    if (length.kind != RequestLength::Kind::known || length.length > bytes.size()) return 0;
    const auto frame = decode_adu(bytes.first(length.length));
    if (!frame || frame->station > kMaxStation || !check_request(frame->pdu)) return 0;
    const bool broadcast = frame->station == 0;
    return broadcast && !is_broadcastable(frame->pdu[0]) ? 0 : length.length;
}

/// On a Modbus/TCP listener one transaction id in 65536 makes a valid ADU fit a CRC: so the bytes
/// count as RTU only if they are nothing but RTU, or do not begin with an ADU.
bool speaks_rtu(Framing expected, ByteView first) {
    std::size_t taken = 0;
    while (const std::size_t size = rtu_request(first.subspan(taken))) taken += size;
    if (taken == 0) return false;
    return expected != Framing::tcp || taken == first.size() || !begins_with_mbap(first);
}

/// True if the bytes are nothing but whole, plausible requests.
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

/// Bytes that may still become an RTU request are left alone.
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
