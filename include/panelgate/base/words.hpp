#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate {

/// Whether the adapter hears what it sends, as the configuration says it (P8).
enum class EchoMode : std::uint8_t {
    automatic,  ///< learned from reads, before the first write
    on,
    off,
};

/// What is known of it.
enum class EchoState : std::uint8_t {
    unknown,
    absent,
    present,
    unclear,  ///< a part of a read came back in front of its answer: whole echoes may come
};
std::string_view label(EchoState state);

/// What a frame on the wire is, for traces.
enum class FrameKind : std::uint8_t {
    // Sent
    request,
    retry,
    probe,       ///< is the station that was offline back?
    learn_echo,  ///< a read that shows whether the line hears itself
    broadcast,
    // Received, and what was waited for
    reply,
    heard_request,  ///< of the line's master, where the gateway only listens
    // Received and thrown away
    damaged,
    echo,             ///< of what was sent last
    foreign_request,  ///< another master's
    late,             ///< a reply whose request was given up
    copy,             ///< a reply once more
    foreign,          ///< a good frame that nobody asked for
};
enum class FrameDirection : std::uint8_t { sent, received, discarded };

FrameDirection direction_of(FrameKind kind);
std::string_view label(FrameKind kind);
std::string_view label(FrameDirection direction);

/// How a station does.
enum class Health : std::uint8_t {
    unknown,  ///< not asked yet
    online,
    suspect,  ///< its last transaction failed, and it is not offline for that
    heard,    ///< answers its line's master, who is somebody else
    offline,  ///< it stays silent: asked by probes only (P4)
};
std::string_view label(Health health);

/// Who goes first on a line (P9).
enum class PriorityClass : std::uint8_t { write, read, poll, probe };
inline constexpr std::size_t kPriorityClasses = 4;

/// The word of the label `class` of panelgate_queue_wait_seconds, and of the reasons in a trace.
std::string_view label(PriorityClass priority);

/// What came of reading the configuration again.
enum class ReloadOutcome : std::uint8_t {
    applied,
    unchanged,  ///< it says what is running
    invalid,    ///< it has faults, or cannot be read
    failed,     ///< it is valid, and a listener or a simulated line could not be opened
    refused,    ///< it is a way back that would weaken what protects, and nobody said so
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
    exception,  ///< the panel's own
    timeout,
    damaged,
    refused,  ///< it never had a way to a panel
    busy,
    expired,
    cancelled,
    offline,
    line_down,
    cached,  ///< a value that was read before
    shared,  ///< by another request's transaction
};
inline constexpr std::array kAllOutcomes{Outcome::ok,        Outcome::exception, Outcome::timeout,
                                         Outcome::damaged,   Outcome::refused,   Outcome::busy,
                                         Outcome::expired,   Outcome::cancelled, Outcome::offline,
                                         Outcome::line_down, Outcome::cached,    Outcome::shared};

/// The word of panelgate_requests_total{outcome} and of a transaction's event.
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

/// What a request on the wire came to, for traces: of one attempt, not of what a client asked.
enum class TransactionEnd : std::uint8_t {
    open,  ///< it is still on the wire
    ok,    ///< its reply has come; a broadcast has left
    exception,
    timeout,
    damaged,
    wrong,      ///< a good frame of its station that does not answer it
    doubtful,   ///< what came may be a copy of an earlier reply: it is asked for once more
    line_down,  ///< the line was lost meanwhile
};

std::string_view label(TransactionEnd end);
/// It ended without its reply.
bool is_error(TransactionEnd end);

/// When what of a request on the wire happened: by the line's rate, from the first bit on.
struct TransactionInstants {
    std::optional<TimePoint> arrived{};  ///< the request that it answers; nothing: nobody's
    TimePoint granted;                   ///< it was its turn
    TimePoint first_bit_out;
    TimePoint last_bit_out;
    std::optional<TimePoint> first_byte_in{};  ///< of what was taken for its reply
    std::optional<TimePoint> last_byte_in{};
};

// What metrics and the log call stations by that have no name of their own: no station may be
// called so.

inline constexpr std::string_view kAllStations = "all";      ///< of a finding about a whole line
inline constexpr std::string_view kOtherStations = "other";  ///< those that nobody has listed

}  // namespace panelgate
