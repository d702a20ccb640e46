#include "panelgate/doctor/finding.hpp"

#include <cstdlib>

namespace panelgate::doctor {

std::string_view code(Cause cause) {
    switch (cause) {
        case Cause::echo:
            return "echo";
        case Cause::no_answer_at_all:
            return "no-answer-at-all";
        case Cause::wrong_baud:
            return "wrong-baud";
        case Cause::wrong_parity:
            return "wrong-parity";
        case Cause::other_master:
            return "other-master";
        case Cause::collision:
            return "collision";
        case Cause::overrun:
            return "overrun";
        case Cause::noise:
            return "noise";
        case Cause::tcp_framing:
            return "tcp-framing";
        case Cause::trailing_bytes:
            return "trailing-bytes";
        case Cause::wrong_crc_order:
            return "wrong-crc-order";
        case Cause::wrong_reply:
            return "wrong-reply";
        case Cause::duplicate_address:
            return "duplicate-address";
        case Cause::timeout_too_short:
            return "timeout-too-short";
        case Cause::gap_too_short:
            return "gap-too-short";
        case Cause::unasked_frames:
            return "unasked-frames";
        case Cause::station_silent:
            return "station-silent";
    }
    std::abort();
}

}  // namespace panelgate::doctor
