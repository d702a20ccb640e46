#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/transaction_end.hpp"
#include "panelgate/base/transaction_instants.hpp"
#include "panelgate/base/wall_time.hpp"

namespace panelgate::bus {

/// How much of what happens on a line is remembered. All of it is set aside at once, touched when
/// it is first used, and never grows: with these figures 667 KiB a line, and the names of
/// clients that have gone, as long as something is known of them.
struct TraceSettings {
    std::size_t transactions = 1000;
    std::size_t frames = 2000;
    std::size_t decisions = 500;
    std::size_t bytes = 256 * 1024;  ///< of all frames; the oldest give way
    std::size_t text = 64 * 1024;    ///< of all decisions
};
/// What is kept of what goes wrong: with these figures some 36 KiB each, taken when one happens for
/// the first time and then used again.
struct IncidentSettings {
    std::size_t incidents = 16;
    std::size_t before = 16;  ///< transactions in front of the first error
    std::size_t after = 16;   ///< behind the last one: nearer errors are of the same incident
    Duration near = 10s;      ///< … and not later than this
    TraceSettings each{48, 128, 32, 12 * 1024, 4 * 1024};
};

/// A frame on the wire, for traces.
struct TraceFrame {
    std::uint64_t sequence = 0;  ///< counts a line's frames, decisions and ends, from 1
    TimePoint at;                ///< first bit out; last byte in
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    std::string why;                ///< of a sent frame: why this one at this time
    WallTime time{};                ///< `at`, by the clock on the wall
    std::uint64_t transaction = 0;  ///< that it is of, or came behind; 0: there was none
};

/// Why something was not done, or not at once; one line.
struct TraceDecision {
    std::uint64_t sequence = 0;  ///< one count with the frames
    TimePoint at;
    std::string text;
    WallTime time{};  ///< `at`, by the clock on the wall
};

/// What one request on the wire was, without its frames.
struct TransactionFacts : TransactionInstants {
    std::uint64_t id = 0;                 ///< counts a line's transactions, from 1
    std::uint64_t first = 0;              ///< sequence of its request
    std::uint64_t sequence = 0;           ///< of its end: one count with frames and decisions
    WallTime time{};                      ///< of first_bit_out
    std::optional<TimePoint> answered{};  ///< whoever had asked; nothing: it was not, by this one
    TransactionEnd end = TransactionEnd::ok;
    std::uint8_t station = 0;  ///< 0: a broadcast
};

/// One that is over, and what came of it.
struct TraceTransaction : TransactionFacts {
    FrameKind kind = FrameKind::request;
    std::string reason;  ///< "read", "write", "poll", "retry", "probe"…: what it was sent for
    std::string client;  ///< who wanted it; "": nobody, or one without a name
    Bytes request;
    Bytes reply;  ///< empty: none
    std::vector<TraceFrame> discarded;
};

/// A part of a line's trace, oldest first.
struct TracePart {
    std::vector<TraceFrame> frames;
    std::vector<TraceDecision> decisions;
    std::vector<TraceTransaction> transactions;
};

/// Something went wrong, and what happened around it is kept.
struct IncidentHead {
    std::uint64_t id = 0;                 ///< counts a line's incidents, from 1
    WallTime time{};                      ///< of its first error
    std::optional<std::uint8_t> station;  ///< of that; nothing: the whole line
    std::string cause;                    ///< "timeout", "damaged", "wrong", "late", "line_down"
    std::uint64_t errors = 0;
    bool complete = false;  ///< false: what follows is still being added
    bool read = false;      ///< somebody has fetched it: it gives way before others do
};
struct Incident {
    IncidentHead head;
    TracePart part;
};

}  // namespace panelgate::bus
