#include "panelgate/modbus/mbap.hpp"

#include <utility>

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

}  // namespace panelgate::modbus
