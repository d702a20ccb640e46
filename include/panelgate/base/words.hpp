#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate {

/// Whether the adapter echoes what it sends, as configured (P8).
enum class EchoMode : std::uint8_t {
    automatic,  ///< learned from reads, before the first write
    on,
    off,
};

/// What is known about the echo.
enum class EchoState : std::uint8_t {
    unknown,
    absent,
    present,
};
std::string_view label(EchoState state);

/// Kind of a frame on the wire, for traces.
enum class FrameKind : std::uint8_t {
    // Sent
    request,
    retry,
    probe,       ///< checks whether an offline station is back
    learn_echo,  ///< a read that shows whether the line echoes
    broadcast,
    // Received and expected
    reply,
    heard_request,  ///< a request of the line's master, in listen-only mode
    // Received and discarded
    damaged,
    echo,             ///< of the frame sent last
    foreign_request,  ///< another master's
    late,             ///< a reply to a request that was given up
    copy,             ///< a duplicate of a reply
    foreign,          ///< an unsolicited valid frame
};
enum class FrameDirection : std::uint8_t { sent, received, discarded };

FrameDirection direction_of(FrameKind kind);
std::string_view label(FrameKind kind);
std::string_view label(FrameDirection direction);

/// Health of a station.
enum class Health : std::uint8_t {
    unknown,  ///< no request sent yet, or the line is down
    online,
    suspect,  ///< its last transaction failed, but it is not offline
    heard,    ///< replies to the line's master, which is not the gateway
    offline,  ///< does not reply: only probes are sent (P4)
};
std::string_view label(Health health);

/// How a station has done lately. Decides how long it is waited for, whether its reads are retried
/// and what its failures may cost the others (src/arbiter/README.md). From good to bad, which is
/// also the value of panelgate_station_condition.
enum class Condition : std::uint8_t {
    well,     ///< it has answered its last request
    unheard,  ///< never heard, and not offline
    missed,   ///< its last attempt was silent
    flaky,    ///< half of its last 8 attempts were silent
    failing,  ///< two transactions in a row have failed
    offline,  ///< offline.after silent transactions in a row
};
std::string_view label(Condition condition);

/// Priority on a line, highest first (P9).
enum class PriorityClass : std::uint8_t { write, read, poll, probe };
inline constexpr std::size_t kPriorityClasses = 4;

/// Returns the value of label `class` of panelgate_queue_wait_seconds, also a reason in a trace.
std::string_view label(PriorityClass priority);

/// Result of reloading the configuration.
enum class ReloadOutcome : std::uint8_t {
    applied,
    unchanged,  ///< same as the running configuration
    invalid,    ///< it has errors, or cannot be read
    failed,     ///< valid, but a listener or a simulated line could not be opened
    refused,    ///< a rollback that would weaken protection, without the user's consent
};
inline constexpr std::array kReloadOutcomes{ReloadOutcome::applied, ReloadOutcome::unchanged,
                                            ReloadOutcome::invalid, ReloadOutcome::failed,
                                            ReloadOutcome::refused};
inline std::string_view label(ReloadOutcome outcome) {
    constexpr std::array<std::string_view, kReloadOutcomes.size()> kWords{
        "applied", "unchanged", "invalid", "failed", "refused"};
    return kWords[static_cast<std::size_t>(outcome)];
}

/// How a request ended, as its client sees it.
enum class Outcome : std::uint8_t {
    ok,
    exception,  ///< from the panel
    timeout,
    damaged,  ///< the panel was heard, but its answer was damaged or did not fit
    refused,  ///< denied, malformed or not routed
    busy,
    expired,
    cancelled,
    offline,
    line_down,
    cached,  ///< answered from the cache
    shared,  ///< answered by another request's transaction
};
inline constexpr std::array kAllOutcomes{Outcome::ok,        Outcome::exception, Outcome::timeout,
                                         Outcome::damaged,   Outcome::refused,   Outcome::busy,
                                         Outcome::expired,   Outcome::cancelled, Outcome::offline,
                                         Outcome::line_down, Outcome::cached,    Outcome::shared};

/// Returns the value of panelgate_requests_total{outcome} and of a transaction's event.
std::string_view label(Outcome outcome);

/// One count for each outcome.
class OutcomeCounts {
  public:
    std::uint64_t& operator[](Outcome outcome) {
        return counts_[static_cast<std::size_t>(outcome)];
    }
    std::uint64_t operator[](Outcome outcome) const {
        return counts_[static_cast<std::size_t>(outcome)];
    }

  private:
    std::array<std::uint64_t, kAllOutcomes.size()> counts_{};
};

/// Result of one attempt on the wire, for traces; not of the client's request.
enum class TransactionEnd : std::uint8_t {
    open,  ///< still on the wire
    ok,    ///< reply received, or broadcast sent
    exception,
    timeout,
    damaged,
    wrong,      ///< a valid frame of its station that does not match the request
    doubtful,   ///< may be a duplicate of an earlier reply: the request is sent again
    line_down,  ///< the line was lost
};

std::string_view label(TransactionEnd end);
/// True if it ended without its reply.
bool is_error(TransactionEnd end);

/// Timestamps of one attempt: on the wire computed from the line's rate, from the first bit on.
struct TransactionInstants {
    std::optional<TimePoint> arrived{};  ///< the client's request, if any
    TimePoint granted;                   ///< its turn came
    TimePoint first_bit_out;
    TimePoint last_bit_out;
    std::optional<TimePoint> first_byte_in{};  ///< of what was taken as its reply
    std::optional<TimePoint> last_byte_in{};
};

// Labels in metrics and logs for stations without a name: no station may have these names.

inline constexpr std::string_view kAllStations = "all";      ///< a finding about a whole line
inline constexpr std::string_view kOtherStations = "other";  ///< stations that are not configured

}  // namespace panelgate
