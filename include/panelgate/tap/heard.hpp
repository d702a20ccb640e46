#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::tap {

/// Something that was said on the line.
struct Frame {
    TimePoint at;  ///< last byte in
    FrameKind kind = FrameKind::damaged;
    /// Whose it is; of damaged bytes the one that was being asked, else what the first byte says.
    std::uint8_t station = 0;
    Bytes bytes;  ///< address to CRC
};

/// How a request of the line's master ended.
enum class End : std::uint8_t {
    answered,  ///< with a reply, normal or the panel's exception
    silent,
    damaged,  ///< something came, but no good reply
    unasked,  ///< nobody answers: a broadcast, or 08/0004
};

/// A request and what came of it.
struct Transaction {
    std::uint8_t station = 0;
    Bytes request;  ///< PDU
    Bytes reply;    ///< PDU; empty unless answered
    End end = End::silent;
    /// The reply may be another request's, or the request itself an echo or a copy: its values are
    /// nobody's.
    bool doubtful = false;
    TimePoint asked;    ///< first bit of the request
    TimePoint sent;     ///< its last bit
    TimePoint replied;  ///< first bit of the reply
    TimePoint ended;    ///< its last bit; without one, when that was clear
    /// What the reply tells is not older: the first of the same requests that it may answer.
    TimePoint sampled;
};

using Event = std::variant<Frame, Transaction>;

}  // namespace panelgate::tap
