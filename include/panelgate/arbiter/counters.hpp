#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::arbiter {

/// How attempts that expect an answer ended, and what else was heard: the basis of diagnosis. Every
/// attempt is one of answered, silent, disturbed, collided, wrong or damaged_*.
struct Symptoms {
    std::uint64_t answered = 0;
    std::uint64_t silent = 0;     ///< not one byte was heard
    std::uint64_t disturbed = 0;  ///< no reply, but frames of other stations, or stale bytes
    std::uint64_t collided = 0;   ///< the echo was not what was sent
    std::uint64_t wrong = 0;      ///< good frames of the station that do not answer the request
    std::uint64_t wrong_exceptions = 0;  ///< ... exceptions with another function's number
    std::uint64_t damaged_exact = 0;     ///< of the reply's length, but no good frame
    std::uint64_t damaged_short = 0;
    std::uint64_t damaged_long = 0;   ///< longer, or of unknown length
    std::uint64_t damaged_heads = 0;  ///< of all damaged: began with the right address and function
    std::uint64_t damaged_bytes = 0;
    /// Linux delivers a byte with a wrong parity bit as zero: termios(3), INPCK without PARMRK.
    std::uint64_t damaged_zeros = 0;
    std::uint64_t damaged_odd = 0;    ///< bytes with an odd number of ones
    std::uint64_t long_answered = 0;  ///< replies of kLongReply bytes or more
    std::uint64_t long_damaged = 0;
    std::uint64_t strays = 0;   ///< runs of damaged bytes around good replies or unsolicited
    std::uint64_t doubled = 0;  ///< repetitions of the last reply, or of its form
    std::uint64_t late = 0;     ///< replies after the response timeout
    std::uint64_t unasked = 0;  ///< unsolicited good frames
    std::uint64_t broadcast_replies = 0;  ///< good frames that answer a broadcast, which is wrong
    std::uint64_t echoes = 0;             ///< requests that came back as sent
    std::uint64_t requests = 0;           ///< good requests of another master
    std::uint64_t crc_swapped = 0;        ///< replies with swapped CRC bytes, otherwise right
    std::uint64_t lower_case = 0;         ///< damaged frames of ASCII in lower-case digits
    std::uint64_t delimited = 0;          ///< ... with other characters around them
    std::uint64_t trailed = 0;            ///< replies followed by bytes or a duplicate
    std::uint64_t beheaded = 0;           ///< of all damaged: right but for lost first bytes
    std::uint64_t misaddressed = 0;       ///< of silent and disturbed: answered by another address
    std::uint64_t repeated = 0;           ///< answered reads that went unanswered a while ago
    std::uint64_t silences = 0;           ///< runs of unanswered attempts that an answer ended

    /// Attempts by the silence before them: below 2 ms, 4 ms, 8 ms … 256 ms, and above.
    /// silent_after counts only reads that were answered when soon asked again.
    static constexpr std::size_t kPauses = 9;
    std::array<std::uint64_t, kPauses> answered_after{};
    std::array<std::uint64_t, kPauses> silent_after{};

    std::uint64_t mute_in_a_row = 0;  ///< attempts without a byte of the station, up to now
    Duration worst_lateness{};        ///< after the response timeout, since the start

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
    std::uint64_t late_frames = 0;     ///< replies that came after their request had failed
    std::uint64_t foreign_frames = 0;  ///< good frames of another station, or of unknown origin
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
    Duration busy{};  ///< request, both gaps, think time, reply: time not usable otherwise
    std::array<Histogram, kPriorityClasses> queue_wait;
};

}  // namespace panelgate::arbiter
