#include "panelgate/arbiter/shared_read.hpp"

#include <algorithm>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

std::optional<ReadSpan> read_span(std::uint8_t station, ByteView pdu) {
    Reader in(pdu);
    ReadSpan span;
    span.station = station;
    span.function = in.u8();
    span.address = in.u16();
    span.count = in.u16();
    constexpr std::uint32_t kItems = 65536;
    const bool read =
        span.function >= modbus::kReadCoils && span.function <= modbus::kReadInputRegisters;
    if (!in.finished() || !read || span.count == 0 || span.end() > kItems) return std::nullopt;
    return span;
}

ReadSpan join(const ReadSpan& a, const ReadSpan& b) {
    ReadSpan both = a;
    both.address = std::min(a.address, b.address);
    both.count = std::max(a.end(), b.end()) - both.address;
    return both;
}

Bytes encode_span(const ReadSpan& span) {
    return Writer().u8(span.function).u16(span.address).u16(span.count).take();
}

Bytes slice_reply(const ReadSpan& whole, ByteView reply, const ReadSpan& part) {
    const std::size_t first = part.address - whole.address;
    if (!part.reads_bits()) {
        Writer out;
        out.u8(part.function).u8(2 * part.count);
        return out.raw(reply.subspan(2 + 2 * first, std::size_t{2} * part.count)).take();
    }
    const std::vector<bool> bits = modbus::bits_of(reply, whole.count);
    const auto begin = bits.begin() + static_cast<std::ptrdiff_t>(first);
    const Bytes packed = modbus::pack_bits(
        std::vector<bool>(begin, begin + static_cast<std::ptrdiff_t>(part.count)));
    Writer out;
    out.u8(part.function).u8(static_cast<unsigned>(packed.size()));
    return out.raw(packed).take();
}

}  // namespace panelgate::arbiter
