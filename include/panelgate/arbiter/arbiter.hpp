#pragma once

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/job_queue.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// Write these bytes in one piece, now.
struct Transmit {
    Bytes adu;
};
/// A job is done: its one and only answer.
struct Finish {
    Ticket ticket = 0;
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< at least once, at least partly
};
/// Something was seen on the wire, for the trace.
struct Note {
    enum class Direction : std::uint8_t { sent, received, discarded };
    TimePoint at;  ///< first bit out, or last byte in
    Direction direction = Direction::sent;
    Bytes bytes;
    std::string_view what;  ///< a literal: "request", "reply", "foreign"…
};
using Action = std::variant<Transmit, Finish, Note>;

struct StationState {
    std::optional<TimePoint> last_success;
    int silent_in_a_row = 0;  ///< transactions without any sign of life
    bool tried = false;
};

/// Decides what one line does: one transaction at a time, the frame gap and nothing else between
/// two, a response timeout from the end of the request on the wire, retries of reads and none of
/// writes, broadcasts without waiting for a reply, a deadline for every request. Pure: time is an
/// argument, actions come out of poll_action(); calling on_deadline early or twice is harmless.
///
///     hand in all bytes that the device holds (on_rx), so that nothing old is taken for new;
///     now = clock; arbiter.on_…(now, …);
///     while (auto action = arbiter.poll_action()) act(*action);
///     alarm at arbiter.next_deadline();
///
/// A line starts down: on_line_up comes first. Acting may call in again: finish the loop, it
/// drains.
class Arbiter {
  public:
    explicit Arbiter(Settings settings);

    /// Accepts a job (its deadline is set here), or Fault::busy / Fault::line_down / Fault::expired
    /// at once. An accepted job gets exactly one Finish.
    Result<Ticket> submit(TimePoint now, Job job);
    /// The client is gone: what it has waiting is finished as cancelled and never transmitted.
    void cancel(TimePoint now, Client client);
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    void on_line_up(TimePoint now);
    void on_line_down(TimePoint now);

    std::optional<Action> poll_action();
    /// When to call on_deadline next; nothing when only an event can change anything.
    std::optional<TimePoint> next_deadline() const;

    std::size_t queue_depth() const { return queue_.size(); }
    /// Nothing waits and nothing is on the wire.
    bool idle() const { return queue_.empty() && !active_; }
    const LineCounters& counters() const { return line_counters_; }
    /// By station; those that the settings do not list share the entry 0.
    const std::map<std::uint8_t, StationCounters>& station_counters() const { return counters_; }
    const StationState& station(std::uint8_t id) const { return states_[id]; }

  private:
    /// The transaction on the wire.
    struct Active {
        Job job;
        modbus::ReplyFramer framer;
        TimePoint started;    ///< first bit out
        TimePoint sent;       ///< last bit out, computed
        TimePoint give_up;    ///< no sign of a reply until here: timeout
        TimePoint last_byte;  ///< heard in this attempt
        TimePoint longest;    ///< a reply that has begun must have ended here
        bool heard = false;
    };

    void step(TimePoint now);
    bool start_next(TimePoint now);
    void start(TimePoint now, Job job);
    void expire(TimePoint now);
    void check_active(TimePoint now);
    void check_broadcast(TimePoint now);
    void settle(TimePoint now, Bytes reply);
    void fail_attempt(TimePoint now, Fault fault);
    void close_active(TimePoint now);
    void finish(const Job& job, Result<Bytes> pdu);
    void note_unused(TimePoint now);
    void hear_idle(TimePoint now, ByteView bytes);
    TimePoint active_deadline() const;
    bool may_retry(const Job& job) const;
    Duration shortest_transaction(const Job& job) const;
    const StationSettings& settings_of(std::uint8_t station) const;
    StationCounters& counters_of(std::uint8_t station);
    Duration gap_of(std::uint8_t station) const;

    Settings settings_;
    std::map<std::uint8_t, StationSettings> stations_;
    std::map<std::uint8_t, StationCounters> counters_;
    std::array<StationState, 256> states_{};
    LineCounters line_counters_;
    JobQueue queue_;
    std::optional<Active> active_;
    std::deque<Action> actions_;
    TimePoint quiet_since_{};        ///< the last bit seen on the line, sent or heard
    TimePoint quiet_until_{};        ///< nothing may be sent before, whatever comes next
    std::uint8_t last_station_ = 0;  ///< whose gap follows quiet_since_
    bool up_ = false;
    Ticket last_ticket_ = 0;
};

}  // namespace panelgate::arbiter
