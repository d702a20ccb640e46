#include "panelgate/doctor/finding.hpp"

#include <array>
#include <cstddef>

namespace panelgate::doctor {
namespace {

/// In the order of Cause.
constexpr std::array<std::string_view, 21> kCodes{
    "echo",
    "no-answer-at-all",
    "wrong-baud",
    "wrong-parity",
    "other-master",
    "collision",
    "overrun",
    "noise",
    "tcp-framing",
    "trailing-bytes",
    "wrong-crc-order",
    "ascii-lower-case",
    "wrong-exception",
    "wrong-reply",
    "answers-broadcasts",
    "damaged-replies",
    "duplicate-address",
    "timeout-too-short",
    "gap-too-short",
    "unasked-frames",
    "station-silent",
};
constexpr std::size_t place(Cause cause) { return static_cast<std::size_t>(cause); }
static_assert(place(Cause::station_silent) + 1 == kCodes.size());
static_assert(kCodes[place(Cause::wrong_crc_order)] == "wrong-crc-order");
static_assert(kCodes[place(Cause::duplicate_address)] == "duplicate-address");

}  // namespace

std::string_view code(Cause cause) { return kCodes[place(cause)]; }

}  // namespace panelgate::doctor
