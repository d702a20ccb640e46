#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

/// Why a frame is sent now. It becomes words only when somebody reads them.
struct Reason {
    enum class Kind : std::uint8_t {
        none,         ///< nobody wants to know, or nobody here has sent it
        learns_echo,  ///< a write is next, and this read finds out about the echo
        probe,
        again,  ///< another attempt
        turn,   ///< it was next
    };
    Kind kind = Kind::none;
    PriorityClass priority = PriorityClass::read;
    std::uint8_t station = 0;
    std::uint8_t asked_function = 0;  ///< what it stands for; 0: its own
    bool passed_over = false;         ///< ahead of a higher class, which had had its turns
    int attempt = 1;
    Duration waited{};
    std::size_t waiting = 0;  ///< behind it, on the whole line
    std::size_t answers = 0;  ///< requests
    ClientName client{};      ///< who wants it
};

/// One line, or "" for none.
std::string text_of(const Reason& reason);

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
