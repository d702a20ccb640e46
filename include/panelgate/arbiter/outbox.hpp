#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/judge.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// The arbiter's output: actions in their order, and counters. It observes the other parts; nothing
/// depends on it. Symptoms are the input of the line diagnosis.
class Outbox {
  public:
    explicit Outbox(const Settings& settings);
    /// Drops the counters of stations that are no longer listed.
    void apply(const Settings& settings);

    std::optional<Action> poll();
    /// `wire`: the bytes that represent `adu` on the line; `why` is told with Settings::explain.
    void transmit(TimePoint now, const Attempt& attempt, Bytes adu, Bytes wire, const Reason& why);
    void finish(const Job& job, Result<Bytes> pdu, bool shared = false);
    void finish_from_memory(Ticket ticket, Bytes pdu, Duration age);
    /// Adds the Exchange of this attempt, with Settings::explain.
    void report(const Attempt& attempt, TransactionEnd end);
    void event(StationEvent::Kind kind, std::uint8_t station, Duration by = {});
    /// Adds a Written if the group is a write.
    void written(const Group& group, bool ended);
    void reset(std::string_view why) { actions_.push_back(Reset{why}); }
    /// Adds a decision, with Settings::explain.
    void decide(const Decision& decision) {
        if (explain_) actions_.push_back(decision);
    }
    /// ... about this request.
    void decide(TimePoint now, Decision::Kind kind, const Job& job, Duration time = {},
                std::size_t count = 0) {
        decide({now, kind, job.station, job.client, job.priority, time, count});
    }

    // What happened on the wire
    void on_started(TimePoint now, const Job& job);
    /// An attempt is over; `gap`: the silence after it, which cannot be used otherwise.
    void on_ended(TimePoint now, const Attempt& attempt, Duration gap);
    /// The whole line rested for `rest`: that time could not be used either.
    void on_rested(Duration rest) { line_.busy += rest; }
    void on_client_gone(Client client) { shares_.forget(client); }
    /// `reply`: without address and CRC.
    void on_answered(TimePoint now, const Attempt& attempt, ByteView reply,
                     const Station::Replied& replied);
    void on_failed(const Attempt& attempt, Verdict verdict);
    /// Emits an event at most every 10 seconds: each would be a log line.
    void on_echo_mismatch(TimePoint now, std::uint8_t station);

    /// Traces and counts a frame, or damaged bytes, that answers no open request; `asked`: the
    /// station asked last. `inside`: an attempt is open; damage is then counted when it ends.
    void on_unsolicited(TimePoint now, const modbus::Unused& part, Done done, std::uint8_t asked,
                        bool inside, Duration lateness = {});

    const LineCounters& line() const { return line_; }
    const std::map<std::uint8_t, StationCounters>& stations() const { return stations_; }
    const BusShares& shares() const { return shares_; }

  private:
    StationCounters& of(std::uint8_t station);
    Symptoms& symptoms_of(std::uint8_t station) { return of(station).symptoms; }
    void count_damaged(const Attempt& attempt);
    void remember_unanswered(const Attempt& attempt, std::uint64_t mute_before);
    void credit_unanswered(const Group& group);

    bool explain_ = false;
    modbus::CrcOrders orders_;
    std::optional<TimePoint> reported_collision_;
    PoolDeque<Action> actions_;
    LineCounters line_;
    BusShares shares_;
    /// The last unanswered read of a station, and the pauses before its attempts.
    struct Unanswered {
        Bytes pdu;
        std::array<std::size_t, 2> pauses{};
        std::size_t count = 0;
    };
    std::map<std::uint8_t, Unanswered> unanswered_;  ///< at most one per station
    Bytes other_frame_;  ///< PDU that came from another station inside this attempt
    std::map<std::uint8_t, StationCounters> stations_;
};

}  // namespace panelgate::arbiter
