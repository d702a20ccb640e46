#include "panelgate/arbiter/shared_read.hpp"

#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part) {
    const std::size_t first = part.first - whole.first;
    const modbus::Function function = modbus::read_function(part.table);
    if (!modbus::is_bit_table(part.table)) {
        Writer out(2 + std::size_t{2} * part.count);
        out.u8(function).u8(2 * part.count);
        return out.raw(reply.subspan(2 + 2 * first, std::size_t{2} * part.count)).take();
    }
    const std::vector<bool> bits = modbus::bits_of(reply, whole.count);
    const auto begin = bits.begin() + static_cast<std::ptrdiff_t>(first);
    const Bytes packed = modbus::pack_bits(
        std::vector<bool>(begin, begin + static_cast<std::ptrdiff_t>(part.count)));
    Writer out;
    out.u8(function).u8(static_cast<unsigned>(packed.size()));
    return out.raw(packed).take();
}

}  // namespace panelgate::arbiter
