#include <algorithm>
#include <cstdlib>
#include <vector>

#include "panelgate/modbus/framing.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

/// The first byte is the size of the pieces: the stream must come out the same whole and in pieces.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t piece = data[0] + std::size_t{1};
    const ByteView stream(data + 1, size - 1);
    MbapFramer whole, pieces;
    std::vector<MbapEvent> expected, given;
    whole.feed(stream);
    while (std::optional<MbapEvent> event = whole.next()) expected.push_back(*event);
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        pieces.feed(stream.subspan(at, std::min(piece, stream.size() - at)));
        while (std::optional<MbapEvent> event = pieces.next()) given.push_back(*event);
    }
    if (expected != given || whole.partial() != pieces.partial()) std::abort();
    return 0;
}
