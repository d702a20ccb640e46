#include <algorithm>
#include <cstdlib>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

using namespace panelgate;
using namespace panelgate::modbus;

namespace {

/// Each frame is a part of the stream, behind the one before it; no byte is given twice.
void expect_in_order(ByteView stream, const std::vector<SerialAdu>& frames) {
    auto at = stream.begin();
    for (const SerialAdu& adu : frames) {
        const Bytes bytes = encode_adu(adu.station, adu.pdu);
        if (bytes.size() > kMaxRtuAdu) std::abort();
        const auto found = std::search(at, stream.end(), bytes.begin(), bytes.end());
        if (found == stream.end()) std::abort();
        at = found + static_cast<std::ptrdiff_t>(bytes.size());
    }
}

/// Nothing that writes is found in the data of a damaged write.
void expect_no_write_inside(ByteView data) {
    Bytes pdu{kWriteMultipleRegisters, 0, 0, 0, 0, 0};
    pdu.insert(pdu.end(), data.begin(), data.end());
    pdu[4] = pdu[5] = static_cast<std::uint8_t>(data.size());
    Bytes damaged = encode_adu(1, pdu);
    damaged.back() ^= 0x01;
    RtuRequestFramer framer;
    framer.feed(damaged);
    for (const bool silence : {false, true}) {
        if (silence) framer.on_silence();
        while (const auto frame = framer.next()) {
            if (!is_pure_read(frame->pdu)) std::abort();
        }
    }
}

}  // namespace

/// The first byte is the size of the pieces: the stream gives the same whole and in pieces, and
/// with a silence between the pieces nothing but what it holds. Never more than a frame is kept.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t piece = data[0] + std::size_t{1};
    const ByteView stream(data + 1, size - 1);
    RtuRequestFramer whole, pieces, pauses;
    std::vector<SerialAdu> expected, given, paused;
    whole.feed(stream);
    while (auto frame = whole.next()) expected.push_back(std::move(*frame));
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        const ByteView part = stream.subspan(at, std::min(piece, stream.size() - at));
        pieces.feed(part);
        pauses.feed(part);
        while (auto frame = pieces.next()) given.push_back(std::move(*frame));
        while (auto frame = pauses.next()) paused.push_back(std::move(*frame));
        pauses.on_silence();
        while (auto frame = pauses.next()) paused.push_back(std::move(*frame));
    }
    if (expected != given || whole.partial() != pieces.partial()) std::abort();
    expect_in_order(stream, expected);
    expect_in_order(stream, paused);
    const std::size_t before = pauses.discarded();
    pauses.drop_pending();
    if (pauses.partial() || pauses.discarded() - before > kMaxRtuAdu) std::abort();
    expect_no_write_inside(stream.first(std::min<std::size_t>(stream.size(), 246)));
    return 0;
}
