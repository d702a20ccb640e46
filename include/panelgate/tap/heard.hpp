#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::tap {

/// A frame or damage heard on the line.
struct Frame {
    TimePoint at;  ///< last byte in
    FrameKind kind = FrameKind::damaged;
    /// The station; of damaged bytes the station of the open request, else the first byte.
    std::uint8_t station = 0;
    Bytes bytes;  ///< address to CRC
};

/// How a request of the line's master ended.
enum class End : std::uint8_t {
    answered,  ///< with a reply, normal or an exception
    silent,
    damaged,  ///< bytes came, but no good reply
    unasked,  ///< no reply is expected: a broadcast, or 08/0004
    wrong,    ///< good frames of the station came that do not answer the request
};

/// A request and its outcome.
struct Transaction {
    std::uint8_t station = 0;
    Bytes request;  ///< PDU
    Bytes reply;    ///< PDU; empty unless answered
    End end = End::silent;
    /// The reply may belong to another request, or the request may be a late reply: the values of
    /// this transaction are not to be used.
    bool doubtful = false;
    TimePoint asked;    ///< first bit of the request
    TimePoint sent;     ///< last bit of the request
    TimePoint replied;  ///< first bit of the reply
    TimePoint ended;    ///< last bit of the reply; without a reply, when the request was closed
    /// The values are not older than this: when the first of the equal requests began that the
    /// reply may answer.
    TimePoint sampled;
    std::size_t damaged = 0;  ///< bytes behind the request that were no good frame
};

using Event = std::variant<Frame, Transaction>;

}  // namespace panelgate::tap
