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
    if (!broken_) buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<MbapEvent> MbapFramer::next() {
    const std::optional<Prefix> prefix = read_prefix(waiting());
    if (!prefix) return std::nullopt;
    if (!is_legal(prefix->length)) {
        broken_ = true;
        take(waiting().size());
        return MbapEvent(Broken{});
    }
    const std::size_t size = kMbapPrefix + prefix->length;
    if (waiting().size() < size) return std::nullopt;
    if (prefix->protocol != 0) {
        take(size);
        return MbapEvent(SkippedProtocol{});
    }
    const ByteView body = waiting().subspan(kMbapPrefix, prefix->length);
    const ByteView pdu = body.subspan(1);
    Adu adu;
    adu.transaction = prefix->transaction;
    adu.unit = body[0];
    adu.pdu.assign(pdu.begin(), pdu.end());
    take(size);
    return MbapEvent(std::move(adu));
}

bool MbapFramer::partial() const {
    if (waiting().empty()) return false;
    const std::optional<Prefix> prefix = read_prefix(waiting());
    return !prefix || (is_legal(prefix->length) && waiting().size() < kMbapPrefix + prefix->length);
}

/// Moves the rest to the front only when at least as much was taken: each byte moves O(1) times.
void MbapFramer::take(std::size_t count) {
    taken_ += count;
    if (taken_ < buffer_.size() - taken_) return;
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(taken_));
    taken_ = 0;
}

Bytes encode_mbap(std::uint16_t transaction, std::uint8_t unit, ByteView pdu) {
    Writer out(kMbapPrefix + 1 + pdu.size());
    out.u16(transaction).u16(0).u16(static_cast<unsigned>(pdu.size() + 1)).u8(unit).raw(pdu);
    return out.take();
}

}  // namespace panelgate::modbus
