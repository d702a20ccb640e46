#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/rights.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/doctor/finding.hpp"
#include "panelgate/doctor/settings.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/tap/heard.hpp"

namespace panelgate::bus {

/// The line went up or down, or a finding appeared or disappeared.
struct LineEvent {
    bool up = false;
    std::string why;           ///< cause, when the line is down; or the finding
    std::uint8_t station = 0;  ///< that the finding is about; 0: none alone
};
/// Another master's request was heard on a driven line.
struct ForeignRequest {
    std::uint8_t station = 0;
};
/// A request was answered.
struct TransactionEvent {
    std::uint8_t station = 0;
    std::uint8_t function = 0;
    Outcome outcome = Outcome::ok;
    Duration took{};  ///< from arrival to answer
};
/// A write by any face, once, when it has ended: what an audit records. Valid for the call only.
struct WriteEnd {
    WhoRef who{};
    Bytes pdu{};  ///< as asked; any bytes, if refused before the request was submitted
    std::optional<modbus::Span> items{};  ///< that it writes, if it says so
    bool logged = true;                   ///< false: the gateway's own (relays), only for the audit
    bool transmitted = false;
    arbiter::Transaction transaction = 0;     ///< the last one made for it; 0: none
    std::optional<std::uint8_t> exception{};  ///< the panel's
    /// The rule that refused the write: of `access` by its name, else the label of its Rule; "":
    /// the write was not refused.
    std::string rule{};
    bool denied = false;       ///< by a rule of `access`
    std::uint8_t station = 0;  ///< 0: a broadcast
    Outcome outcome = Outcome::ok;
};

/// What a bus reports to its observer.
using BusEvent = std::variant<LineEvent, arbiter::StationEvent, TransactionEvent, WriteEvent,
                              tap::Transaction, ForeignRequest>;

struct Settings {
    std::string name;    ///< of the line
    std::string device;  ///< as configured
    arbiter::Settings arbiter;
    Stations stations;                             ///< stations listed in the configuration
    std::function<void(const BusEvent&)> observe;  ///< may be empty; called from inside the bus
    TraceSettings trace;
    IncidentSettings incidents;
    doctor::Settings doctor;
    ClientSettings clients{};
    std::function<void(const WriteEnd&)> record_write{};  ///< may be empty; must not call the bus
    /// Asked before each frame; false: the frame is not sent. May be empty; must not call the bus.
    std::function<bool()> may_send{};
    /// Requests of clients are refused as by a box that waits for another box to go.
    bool standby = false;
    /// True while no write may be sent, as it could not be recorded. May be empty.
    std::function<bool()> refuses_writes{};
    std::shared_ptr<const access::LineRules> access{};  ///< null: everybody may do everything
    Admit
        admit{};  ///< what doors allow now; empty: what doors allowed before. Must not call the bus
};

struct LineRecords;

/// What a line shows of its records, whether the line is driven or only listened to.
class RecordedBus : public LineBus {
  public:
    void count_denied(std::string_view rule) override;
    void name_client(ClientId client, std::string name) override;
    TracePart trace(std::size_t last) const override;
    TracePart trace_since(std::uint64_t sequence, std::size_t most) const override;
    std::vector<IncidentHead> incidents() const override;
    std::optional<Incident> incident(std::uint64_t id) override;
    bool tells(const WhoRef& who, std::uint8_t station) const override;

  private:
    virtual LineRecords& records() const = 0;
};

/// Drives one line with one arbiter. Not thread-safe: use it only on the executor's thread.
class Bus final : public RecordedBus {
  public:
    /// Answers are delivered from the executor's loop. The executor and `clock` outlive the bus.
    Bus(boost::asio::any_io_executor executor, rt::Clock& clock, Settings settings,
        std::unique_ptr<line::Line> line);
    /// Answers open requests with Fault::cancelled.
    ~Bus() override;

    void start() override;
    /// Closes the line and answers waiting requests at once (line_down, line_lost).
    void stop() override;
    void apply(Settings settings, std::unique_ptr<line::Line> line,
               std::shared_ptr<void> far_end) override;
    void judge_waiting() override;

    void transact(Request request, AnswerHandler handler) override;
    void count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) override;
    void cancel(ClientId client) override;
    LineStatus status() const override;
    std::vector<ClientShare> clients() const override;
    StationStatus station_status(std::uint8_t station) const override;
    OutcomeCounts outcomes(std::uint8_t station) const override;
    std::optional<Refusal> write_refusal(std::uint8_t station) const override;
    std::optional<Refusal> refusal_of(const Request& request) const override;

    TimePoint clear_at() const override;
    void rest_until(TimePoint until) override;
    LineReport report() const override;
    /// True if no request waits and none is on the wire.
    bool idle() const;

  private:
    LineRecords& records() const override;
    void close();

    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::bus
