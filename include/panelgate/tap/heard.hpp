#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::tap {

/// A frame or damage heard on the line.
struct Frame {
    TimePoint at;  ///< last byte in
    FrameKind kind = FrameKind::damaged;
    /// The station; for damaged bytes the one asked last, else the first byte.
    std::uint8_t station = 0;
    Bytes bytes;  ///< address to CRC
};

/// How a request of the line's master ended.
enum class End : std::uint8_t {
    answered,  ///< with a reply, normal or an exception
    silent,
    damaged,  ///< bytes came, but no good reply
    unasked,  ///< no reply is expected: a broadcast, or 08/0004
    wrong,    ///< good frames of the station came that do not answer it
};

/// A request and its outcome.
struct Transaction {
    std::uint8_t station = 0;
    Bytes request;  ///< PDU
    Bytes reply;    ///< PDU; empty unless answered
    End end = End::silent;
    /// The reply may belong to another request, or the request may be an echo or a duplicate: do
    /// not use its values.
    bool doubtful = false;
    TimePoint asked;    ///< first bit of the request
    TimePoint sent;     ///< its last bit
    TimePoint replied;  ///< first bit of the reply
    TimePoint ended;    ///< its last bit; without a reply, when that was known
    /// The values are not older than this: the first of the equal requests that the reply may
    /// answer.
    TimePoint sampled;
    std::size_t damaged = 0;  ///< bytes that came and were no good frame
};

using Event = std::variant<Frame, Transaction>;

}  // namespace panelgate::tap
