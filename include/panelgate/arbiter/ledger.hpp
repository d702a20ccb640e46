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
#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// What the arbiter says: actions in their order, and counts. It listens to what the parts return;
/// nothing depends on it. Symptoms are what the line doctor looks at.
class Ledger {
  public:
    explicit Ledger(const Settings& settings);
    /// What was counted of stations that are no longer listed is forgotten.
    void apply(const Settings& settings);

    std::optional<Action> poll();
    /// `wire`: the bytes that say `adu` on the line.
    void transmit(TimePoint now, const Attempt& attempt, Bytes adu, Bytes wire, Reason why);
    void finish(const Job& job, Result<Bytes> pdu, bool shared = false);
    void finish_from_memory(Ticket ticket, Bytes pdu, Duration age);
    /// With Settings::explain.
    void tell(const Attempt& attempt, TransactionEnd end);
    void event(StationEvent::Kind kind, std::uint8_t station, Duration by = {});
    /// Says so of a group that may change something.
    void written(const Group& group, bool ended);
    void reset(std::string_view why) { actions_.push_back(Reset{why}); }
    /// One line, put into words only when Settings::explain wants it.
    template <class Text>
    void decide(TimePoint now, const Text& text) {
        if (explain_) actions_.push_back(Decision{now, text()});
    }
    bool explains() const { return explain_; }

    // What happened on the wire
    void on_started(TimePoint now, const Job& job);
    /// An attempt is over; `gap`: the silence behind it, which nobody else can use.
    void on_ended(TimePoint now, const Attempt& attempt, Duration gap);
    /// The whole line was left alone for so long: nobody could use that either.
    void on_rested(Duration rest) { line_.busy += rest; }
    void on_client_gone(Client client) { shares_.forget(client); }
    void on_answered(TimePoint now, const Attempt& attempt, Duration think,
                     const Station::Replied& replied);
    void on_failed(const Attempt& attempt, Verdict verdict);
    /// Told once in a while: each one would be a line in somebody's log.
    void on_echo_mismatch(TimePoint now, std::uint8_t station);

    /// What a good frame is that nobody waits for, or that some bytes are damaged.
    enum class Part : std::uint8_t {
        damaged,
        echo,
        request,
        late,
        copy,
        broadcast_reply,
        unasked,
        unknown,
    };
    /// Traces and counts it; `asked` is who was asked last. Damage inside an attempt is its own.
    void on_stray(TimePoint now, const modbus::Unused& part, Part what, std::uint8_t asked,
                  Duration lateness = {});
    void inside_attempt(bool inside) { inside_attempt_ = inside; }

    const LineCounters& line() const { return line_; }
    const std::map<std::uint8_t, StationCounters>& stations() const { return stations_; }
    const BusShares& shares() const { return shares_; }

  private:
    StationCounters& of(std::uint8_t station);
    Symptoms& symptoms_of(std::uint8_t station) { return of(station).symptoms; }
    void count_damaged(const Attempt& attempt);
    void remember_unheard(const Attempt& attempt, std::uint64_t mute_before);
    void credit_unheard(const Group& group);
    void count_stray(const modbus::Unused& part, Part what, std::uint8_t asked, Duration lateness);

    bool explain_ = false;
    modbus::CrcOrders orders_;
    bool inside_attempt_ = false;
    std::optional<TimePoint> told_collision_;
    PoolDeque<Action> actions_;
    LineCounters line_;
    BusShares shares_;
    /// The last read of a station that stayed without reply, and the pauses before its attempts.
    struct Unheard {
        Bytes pdu;
        std::array<std::size_t, 2> pauses{};
        std::size_t count = 0;
    };
    std::map<std::uint8_t, Unheard> unheard_;  ///< at most one a station
    std::map<std::uint8_t, StationCounters> stations_;
};

}  // namespace panelgate::arbiter
