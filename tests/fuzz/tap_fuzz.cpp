#include <cstdlib>
#include <variant>

#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/tap/matcher.hpp"

using namespace panelgate;
using namespace panelgate::tap;

namespace {

struct Totals {
    std::size_t told = 0;
};

void judge(const Frame& frame, Totals& totals) {
    totals.told += frame.bytes.size();
    if (frame.bytes.empty()) std::abort();
    if (frame.kind != FrameKind::damaged && !modbus::crc_ok(frame.bytes)) std::abort();
}

void judge(const Transaction& made, Totals&) {
    const bool answered = made.end == End::answered;
    if (made.request.empty() || made.reply.empty() == answered) std::abort();
    if (answered && !modbus::answers(made.request, made.reply)) std::abort();
    if (answered && made.station == 0) std::abort();
    if (made.sent < made.asked || made.ended < made.sent || made.sampled > made.asked) std::abort();
}

}  // namespace

/// Whatever is heard, in whatever pieces and at whatever times: what is paired answers its request,
/// each byte is told once, and nothing is kept behind a silence. The first byte of a piece tells
/// its size and the pause before it; "F" in front of a piece seals its bytes with a CRC.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Matcher matcher(Settings{SerialFormat{38400, 8, Parity::none, 1}});
    TimePoint now{1h};
    Totals totals;
    std::size_t fed = 0;
    const auto collect = [&] {
        while (const auto event = matcher.poll_action())
            std::visit([&](const auto& one) { judge(one, totals); }, *event);
    };
    const auto wait = [&](Duration pause) {
        const TimePoint until = now + pause;
        for (int i = 0; i < 10; ++i) {
            const auto next = matcher.next_deadline();
            if (!next || *next > until) break;
            now = std::max(now, *next);
            matcher.on_deadline(now);
            collect();
        }
        now = until;
    };
    ByteView left(data, size);
    while (left.size() >= 2) {
        const bool sealed = left[0] == 'F';
        if (sealed) left = left.subspan(1);
        constexpr Duration kPauses[] = {0ms, 3ms, 70ms, 400ms};
        wait(kPauses[left[0] >> 6]);
        const std::size_t n = std::min<std::size_t>(left[0] & 0x3F, left.size() - 1);
        const ByteView piece = left.subspan(1, n);
        const Bytes bytes = sealed && n > 0 ? modbus::encode_adu(piece[0], piece.subspan(1))
                                            : Bytes(piece.begin(), piece.end());
        matcher.on_rx(now, bytes);
        fed += bytes.size();
        collect();
        left = left.subspan(1 + n);
    }
    wait(1h);
    if (matcher.next_deadline()) std::abort();
    if (totals.told != fed) std::abort();
    return 0;
}
