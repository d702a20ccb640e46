#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/reason.hpp"
#include "panelgate/arbiter/transaction_numbers.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/transaction_end.hpp"
#include "panelgate/base/transaction_instants.hpp"
#include "panelgate/modbus/span.hpp"

namespace panelgate::arbiter {

/// Write these bytes in one piece, now: a frame in the line's mode.
struct Transmit {
    Bytes adu;
};
/// A job is done: its one and only answer.
struct Finish {
    Ticket ticket = 0;
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< at least once, at least partly
    bool shared = false;       ///< another job's transaction answered it too
    /// Of a value that was read before and answers from memory (max_age).
    std::optional<Duration> age;
    TransactionNumbers transactions{};  ///< that were made for it
};
/// Something was seen on the wire, for the trace. Frames stand there as RTU says them.
struct Note {
    TimePoint at;  ///< first bit out, or last byte in
    FrameKind kind = FrameKind::request;
    Bytes bytes;
    Reason why{};                 ///< of a sent frame, with Settings::explain: why this one now
    Transaction transaction = 0;  ///< that a sent frame begins
};
/// With Settings::explain: a transaction is over. Said behind the frame that ends it, before the
/// Finish of those that it answers.
struct Exchange : TransactionInstants {
    Transaction transaction = 0;
    TransactionEnd end = TransactionEnd::open;
    std::uint8_t station = 0;
};
/// With Settings::explain: why something is not done now, or not at all. One line.
struct Decision {
    TimePoint at;
    std::string text;
};
/// A station changed its health, or showed something that its owner should know.
struct StationEvent {
    enum class Kind : std::uint8_t {
        offline,
        online,
        late,       ///< it answered `by` after the response timeout
        drift,      ///< 95 of 100 replies take up to `by`: near the response timeout
        collision,  ///< the echo of a request to it differed from what was sent
        echo,       ///< a request to it came back: the line hears itself
        trail,      ///< something stands behind its replies, up to `by`: the line waits for that
    };
    Kind kind = Kind::online;
    std::uint8_t station = 0;
    Duration by{};
};
std::string_view label(StationEvent::Kind kind);
/// A request that may change what a station holds is about to leave, or its attempt is over,
/// answered or not. Said at each attempt, before its Finish.
struct Written {
    std::uint8_t station = 0;           ///< 0: all of them
    std::optional<modbus::Span> items;  ///< nothing: the request names none
    bool ended = false;
    Client client = 0;  ///< whose it is; 0: nobody waits for it any more
};
/// Close the way to the wire and open it again, so that nothing that was sent on it is answered any
/// more: then on_line_down and on_line_up.
struct Reset {
    std::string_view why;  ///< a literal, for people
};
using Action =
    std::variant<Transmit, Finish, Note, Decision, StationEvent, Written, Reset, Exchange>;

}  // namespace panelgate::arbiter
