#include "panelgate/modbus/rtu_framer.hpp"

#include <cstdlib>

#include "panelgate/modbus/response.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

/// Whatever is heard, in whatever pieces: what is accepted answers the request, and no byte is
/// accounted for twice. The first byte chooses the size of the pieces and who has which order of
/// the CRC, 0 among them is a silence.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Bytes request{0x03, 0x00, 0x6B, 0x00, 0x03};
    if (size == 0) return 0;
    CrcOrders orders;
    if ((data[0] & 0x80) != 0) orders.set(0x11, CrcOrder::high_first);
    if ((data[0] & 0x40) != 0) orders.set(0x12, CrcOrder::high_first);
    ReplyFramer framer(0x11, request, orders);
    const std::size_t piece = data[0] % 16u + 1;
    ByteView heard(data + 1, size - 1);
    std::size_t accepted = 0;
    while (!heard.empty()) {
        const std::size_t n = std::min(piece, heard.size());
        auto reply = heard[0] == 0 ? framer.on_silence() : std::nullopt;
        if (!reply) reply = framer.feed(heard.first(n));
        if (reply && !answers(request, *reply)) std::abort();
        if (reply) accepted += reply->size() + 3;
        heard = heard.subspan(n);
    }
    framer.on_silence();
    for (const Unused& part : framer.take_unused()) accepted += part.bytes.size();
    if (accepted > size + size) std::abort();
    return 0;
}
