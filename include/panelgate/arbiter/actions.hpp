#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

/// Why a frame is sent now.
struct Reason {
    enum class Kind : std::uint8_t {
        none,         ///< explain is off, or the frame is not ours
        learns_echo,  ///< a read that detects the line's echo before a write
        probe,
        again,  ///< a retry
        turn,   ///< next in turn
    };
    Kind kind = Kind::none;
    PriorityClass priority = PriorityClass::read;
    std::uint8_t station = 0;
    std::uint8_t asked_function = 0;  ///< that the client asked for; 0: the request's own
    bool passed_over = false;         ///< ahead of a higher class that had its turns
    int attempt = 1;
    std::uint32_t answers = 0;  ///< number of requests it answers
    Duration waited{};
    std::size_t waiting = 0;  ///< requests still queued on the whole line
    Client client = 0;        ///< that it is sent for
};

/// Write these bytes in one piece, now: a frame in the line's mode.
struct Transmit {
    Bytes adu;
};
/// A job is done: its only result.
struct Finish {
    Ticket ticket = 0;
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< at least once, at least in part
    bool shared = false;       ///< answered by another job's transaction
    /// Age of a value answered from memory (max_age).
    std::optional<Duration> age;
    TransactionNumbers transactions{};  ///< that were made for the job
};
/// A frame seen on the wire, for the trace; always in RTU form.
struct Note {
    TimePoint at;  ///< first bit out, or last byte in
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    Reason why{};                 ///< of a sent frame, with Settings::explain
    Transaction transaction = 0;  ///< begun by this sent frame
};
/// With Settings::explain: a transaction is over. Between its last frame and the jobs' Finish.
struct Exchange : TransactionInstants {
    Transaction transaction = 0;
    TransactionEnd end = TransactionEnd::open;
    std::uint8_t station = 0;
};
/// With Settings::explain: why something is not done now, or not at all.
struct Decision {
    enum class Kind : std::uint8_t {
        // Of a request.
        offline,     ///< refused; the next probe is due in `time`
        full,        ///< refused: so many wait
        shed,        ///< given up for a newcomer
        expired,     ///< given up after `time`: it could not end before its deadline
        unanswered,  ///< given up after `time`: it was sent, and not answered before its deadline
        // Of a station.
        condition,   ///< it has changed
        line_rests,  ///< only its request is sent for `time`: it may answer late
    };
    TimePoint at;
    Kind kind = Kind::offline;
    std::uint8_t station = 0;
    Client client = 0;  ///< whose request it is
    PriorityClass priority = PriorityClass::read;
    Duration time{};
    std::size_t count = 0;  ///< requests that wait, or silent transactions in a row
    Condition condition{};  ///< of the station, now
};
/// The health of a station has changed, or an operator should know something about the station.
struct StationEvent {
    enum class Kind : std::uint8_t {
        offline,
        online,
        suspect,    ///< this and the next two are told by the bus, not by the arbiter
        heard,      ///< on a line in listen mode
        unknown,    ///< its line is down
        late,       ///< it answered `by` after the response timeout
        drift,      ///< 95 of 100 replies take up to `by`: near the response timeout
        collision,  ///< the echo of a request to it differed from what was sent
        echo,       ///< a request to it came back: the line hears itself
        trail,      ///< bytes follow its replies for up to `by`: the line waits for that
    };
    Kind kind = Kind::online;
    std::uint8_t station = 0;
    Duration by{};
};
inline std::string_view label(StationEvent::Kind kind) {
    constexpr std::string_view kWords[] = {"offline", "online", "suspect",   "heard", "unknown",
                                           "late",    "drift",  "collision", "echo",  "trail"};
    return kWords[static_cast<std::size_t>(kind)];
}
/// A write is about to be sent, or its attempt is over, answered or not; before its Finish.
struct Written {
    std::uint8_t station = 0;           ///< 0: all stations
    std::optional<modbus::Span> items;  ///< empty: the request names no items
    bool ended = false;
    Client client = 0;  ///< 0: no client waits for it any more
};
/// Close the transport and open the transport again, so that no earlier request is answered any
/// more: then call on_line_down and on_line_up.
struct Reset {
    std::string_view why;  ///< a string literal, for the log
};
using Action =
    std::variant<Transmit, Finish, Note, Decision, StationEvent, Written, Reset, Exchange>;

}  // namespace panelgate::arbiter
