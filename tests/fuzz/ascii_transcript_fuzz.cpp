#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

namespace {

using Piece = AsciiTranscript::Piece;

/// What stands between two ends, and what has none yet.
std::vector<std::pair<Bytes, Piece::End>> parts_of(HexDigits digits, ByteView stream,
                                                   std::size_t piece) {
    AsciiTranscript transcript(digits);
    std::vector<std::pair<Bytes, Piece::End>> parts(1);
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        transcript.feed({}, stream.subspan(at, std::min(piece, stream.size() - at)));
        while (const auto next = transcript.next()) {
            if (next->bytes.empty() && next->end == Piece::End::none) std::abort();
            Bytes& bytes = parts.back().first;
            bytes.insert(bytes.end(), next->bytes.begin(), next->bytes.end());
            parts.back().second = next->end;
            if (next->end != Piece::End::none) parts.emplace_back();
        }
    }
    return parts;
}

}  // namespace

/// The first byte is the size of the pieces: the same comes out of the whole stream and of its
/// pieces, the frames are those that a slave would find, and nothing has more bytes than it had
/// characters.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const ByteView stream(data + 1, size - 1);
    for (const HexDigits digits : {HexDigits::upper_only, HexDigits::any_case}) {
        const auto parts = parts_of(digits, stream, stream.size() + 1);
        if (parts != parts_of(digits, stream, data[0] + std::size_t{1})) std::abort();
        AsciiFramer framer(digits);
        framer.feed({}, stream);
        std::size_t heard = 0;
        for (const auto& [bytes, end] : parts) {
            heard += bytes.size();
            if (end != Piece::End::frame) continue;
            if (!crc_ok(bytes)) std::abort();
            if (bytes.size() > kMaxRtuAdu) continue;  // no slave of the standard takes it
            const auto frame = framer.next();
            if (!frame || encode_adu(frame->station, frame->pdu) != bytes) std::abort();
        }
        if (framer.next() || heard > stream.size()) std::abort();
    }
    return 0;
}
