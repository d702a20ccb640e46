#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::arbiter {

/// How attempts ended that expect an answer, and what was heard besides: what a line's troubles are
/// told by. Every attempt is one of answered, silent, disturbed, collided, wrong or damaged_*.
struct Symptoms {
    std::uint64_t answered = 0;
    std::uint64_t silent = 0;     ///< not one byte was heard
    std::uint64_t disturbed = 0;  ///< no reply, but good frames of others, or bytes that were stale
    std::uint64_t collided = 0;   ///< the echo was not what was sent
    std::uint64_t wrong = 0;      ///< a good frame of the station that does not answer the request
    std::uint64_t wrong_exceptions = 0;  ///< ... an exception with another function's number
    std::uint64_t damaged_exact = 0;     ///< as long as the reply has to be, and yet no good frame
    std::uint64_t damaged_short = 0;
    std::uint64_t damaged_long = 0;   ///< longer, or nothing tells how long it has to be
    std::uint64_t damaged_heads = 0;  ///< of all damaged: began with the right address and function
    std::uint64_t damaged_bytes = 0;
    /// Linux gives a byte with a wrong parity bit as zero: termios(3), INPCK without PARMRK.
    std::uint64_t damaged_zeros = 0;
    std::uint64_t damaged_odd = 0;    ///< bytes with an odd number of ones
    std::uint64_t long_answered = 0;  ///< replies of kLongReply bytes or more
    std::uint64_t long_damaged = 0;
    std::uint64_t strays = 0;   ///< damaged bytes around good replies or unasked, each time
    std::uint64_t doubled = 0;  ///< the reply taken before, or one of its shape, once more
    std::uint64_t late = 0;     ///< replies behind the whole response timeout
    std::uint64_t unasked = 0;  ///< good frames that nobody here asked for
    std::uint64_t broadcast_replies = 0;  ///< good frames that answer a broadcast: nobody should
    std::uint64_t echoes = 0;             ///< the request came back as it was sent
    std::uint64_t requests = 0;           ///< another master's: good requests that are not ours
    std::uint64_t crc_swapped = 0;        ///< damaged only in that the CRC's high byte came first
    std::uint64_t lower_case = 0;         ///< damaged frames of ASCII in lower-case digits
    std::uint64_t trailed = 0;            ///< replies with something behind them: bytes, or a copy

    /// Attempts by the silence before them: below 2 ms, 4 ms, 8 ms … 256 ms, and above. Silent are
    /// reads that were answered when they were asked again soon: no station that is off, no write.
    static constexpr std::size_t kPauses = 9;
    std::array<std::uint64_t, kPauses> answered_after{};
    std::array<std::uint64_t, kPauses> silent_after{};

    std::uint64_t mute_in_a_row = 0;  ///< attempts without a sound of the station, up to now
    Duration worst_lateness{};        ///< behind the response timeout, since the start

    static constexpr std::size_t kLongReply = 32;  ///< bytes, address to CRC

    std::uint64_t damaged() const { return damaged_exact + damaged_short + damaged_long; }
    std::uint64_t attempts() const {
        return answered + silent + disturbed + collided + wrong + damaged();
    }
    friend bool operator==(const Symptoms&, const Symptoms&) = default;
};

/// What happened on the wire, by station. Counted by the arbiter, read by metrics/.
struct StationCounters {
    std::uint64_t retries = 0;
    std::uint64_t late_frames = 0;     ///< replies that were owed: their request was given up
    std::uint64_t foreign_frames = 0;  ///< good frames of another station, or nobody's reply
    std::uint64_t damaged_frames = 0;  ///< bytes that never became a good frame
    std::uint64_t discarded_bytes = 0;
    std::uint64_t echo_mismatches = 0;  ///< collisions: the echo was not what was sent
    std::map<std::uint8_t, std::uint64_t> exceptions;  ///< by code: at most 256
    Histogram bus_transaction;                         ///< first bit out to last bit in
    Histogram turnaround;                              ///< the panel's own think time
    Symptoms symptoms;
};

struct LineCounters {
    std::uint64_t broadcasts = 0;
    Duration busy{};  ///< request, both gaps, think time, reply: what nobody else could use
    std::array<Histogram, kPriorityClasses> queue_wait;
};

}  // namespace panelgate::arbiter
