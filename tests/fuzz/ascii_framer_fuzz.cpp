#include <algorithm>
#include <cstdlib>
#include <vector>

#include "panelgate/modbus/ascii.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

/// The first byte is the size of the pieces: the same frames come out of the whole stream and of
/// its pieces, and each of them stands in the stream as it would be written, upper or lower case.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t piece = data[0] + std::size_t{1};
    const ByteView stream(data + 1, size - 1);
    for (const HexDigits digits : {HexDigits::upper_only, HexDigits::any_case}) {
        AsciiFramer whole(digits), pieces(digits);
        std::vector<SerialAdu> expected, given;
        whole.feed({}, stream);
        while (auto frame = whole.next()) expected.push_back(std::move(*frame));
        for (std::size_t at = 0; at < stream.size(); at += piece) {
            pieces.feed({}, stream.subspan(at, std::min(piece, stream.size() - at)));
            while (auto frame = pieces.next()) given.push_back(std::move(*frame));
        }
        if (expected != given || whole.partial() != pieces.partial()) std::abort();
        if (whole.discarded() != pieces.discarded()) std::abort();
        std::size_t used = 0;
        for (const SerialAdu& adu : expected) {
            const Bytes text = encode_ascii(adu.station, adu.pdu);
            if (adu.pdu.empty() || text.size() > kMaxAsciiAdu) std::abort();
            used += text.size();
            const auto found = std::search(stream.begin(), stream.end(), text.begin(), text.end());
            if (digits == HexDigits::upper_only && found == stream.end()) std::abort();
        }
        if (used + whole.discarded() > stream.size()) std::abort();
    }
    return 0;
}
