#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::bus {

/// What decides on a line: an Arbiter on a serial wire, an Ethernet for a Modbus/TCP device. The
/// members are those of both (arbiter/arbiter.hpp).
class Machine {
  public:
    using Job = arbiter::Job;
    virtual ~Machine() = default;

    virtual void apply(arbiter::Settings settings) = 0;
    virtual void suspend() = 0;
    virtual bool is_waiting() const = 0;
    virtual TimePoint clear_at(TimePoint now) const = 0;
    virtual void rest_until(TimePoint until) = 0;
    virtual void on_line_left() = 0;
    virtual Result<arbiter::Ticket> submit(TimePoint now, Job job) = 0;
    virtual void deny(TimePoint now, const arbiter::JobQueue::Test& match) = 0;
    virtual void cancel(TimePoint now, arbiter::Client client) = 0;
    virtual void on_rx(TimePoint now, ByteView bytes) = 0;
    virtual void on_deadline(TimePoint now) = 0;
    virtual void on_line_up(TimePoint now) = 0;
    virtual void on_line_down(TimePoint now) = 0;
    virtual void set_latency(Duration latency) = 0;
    virtual void set_lead(Duration lead) = 0;
    virtual void confirm_ends(bool confirm) = 0;
    virtual bool wants_end(TimePoint now) const = 0;
    virtual void on_end(TimePoint now, Duration left) = 0;
    virtual bool is_unheard(TimePoint now) const = 0;
    virtual std::optional<arbiter::Action> poll_action() = 0;
    virtual std::optional<TimePoint> next_deadline() const = 0;
    virtual std::optional<TimePoint> busy_until() const = 0;
    virtual std::size_t queue_depth() const = 0;
    virtual bool idle() const = 0;
    virtual const arbiter::LineCounters& counters() const = 0;
    virtual const std::map<std::uint8_t, arbiter::StationCounters>& station_counters() const = 0;
    virtual arbiter::StationHealth health(std::uint8_t id) const = 0;
    virtual Condition condition(std::uint8_t id) const = 0;
    virtual const arbiter::BusShares& shares() const = 0;
    virtual EchoState echo() const = 0;
};

/// Of these settings: `in_flight` tells which.
std::unique_ptr<Machine> make_machine(const arbiter::Settings& settings);

}  // namespace panelgate::bus
