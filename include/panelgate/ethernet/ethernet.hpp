#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/desk.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/modbus/framing.hpp"

namespace panelgate::ethernet {

/// Decides what is sent to one device that speaks Modbus/TCP, whose stations are its unit ids: up
/// to `in_flight` requests are on their way, and a reply counts by its transaction id. Queue,
/// sharing, health, retries and accounts are the arbiter's; a wire's gap, echo and late window are
/// none. Writes of a station are alone there, so that its requests keep their order. Pure; used as
/// an Arbiter is (arbiter.hpp).
class Ethernet : public arbiter::Desk {
  public:
    explicit Ethernet(arbiter::Settings settings);

    void apply(arbiter::Settings settings) { adopt(std::move(settings)); }
    void suspend() { suspended_ = true; }
    bool is_waiting() const { return !flights_.empty(); }
    /// At once: another connection has other transaction ids.
    TimePoint clear_at(TimePoint now) const { return now; }
    void rest_until(TimePoint until) { quiet_.rest_until(until); }
    void on_line_left() { forget_line(true); }

    Result<arbiter::Ticket> submit(TimePoint now, arbiter::Job job);
    void deny(TimePoint now, const arbiter::JobQueue::Test& match);
    void cancel(TimePoint now, arbiter::Client client);
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now) { step(now); }
    void on_line_up(TimePoint now);
    void on_line_down(TimePoint now);

    void set_latency(Duration latency) { latency_ = latency; }
    void set_lead(Duration) {}
    void confirm_ends(bool) {}
    bool wants_end(TimePoint) const { return false; }
    void on_end(TimePoint, Duration) {}
    /// True if one of the requests has timed out.
    bool is_unheard(TimePoint now) const;

    std::optional<TimePoint> next_deadline() const;
    std::optional<TimePoint> busy_until() const { return std::nullopt; }

    /// True if no job waits and no client's request is on its way.
    bool idle() const;
    EchoState echo() const { return EchoState::absent; }

  private:
    /// A request on its way.
    struct Flight {
        std::uint16_t id = 0;  ///< of its Modbus/TCP transaction
        arbiter::Attempt attempt;
    };
    /// A request whose reply did not come in time: it may come late.
    struct Past {
        std::uint16_t id = 0;
        std::uint8_t station = 0;
        TimePoint sent;
    };
    using Flights = std::vector<Flight>;

    void forget_line(bool keeps);
    void step(TimePoint now);
    void expire(TimePoint now);
    bool may_start(std::uint8_t station, bool read) const;
    void start(TimePoint now, arbiter::Group group);
    arbiter::Attempt make_attempt(TimePoint now, arbiter::Group group, const Bytes& adu) const;
    void take(TimePoint now, const modbus::Adu& reply);
    void take_other(TimePoint now, const modbus::Adu& reply);
    void settle(TimePoint now, Flights::iterator flight, const Bytes& reply);
    void fail(TimePoint now, Flights::iterator flight, arbiter::Verdict verdict);
    void end(TimePoint now, arbiter::Group& group, arbiter::Verdict verdict, bool affordable);
    arbiter::Attempt land(TimePoint now, Flights::iterator flight);
    void count(TimePoint now, const arbiter::Attempt& attempt);

    arbiter::Quiet quiet_{{}, {}};
    arbiter::EchoMemory echo_{EchoMode::off};
    modbus::MbapFramer framer_;
    Flights flights_;       ///< the oldest first
    PoolDeque<Past> past_;  ///< the oldest first, at most kPast
    std::uint16_t last_id_ = 0;
    TimePoint counted_{};  ///< until then the line's busy time is counted
    Duration latency_{};
};

}  // namespace panelgate::ethernet
