#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/rights.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::line {
class Line;
}

namespace panelgate::bus {

class BusClient;

/// A station's name and address.
struct StationRef {
    std::string name;  ///< unique; "LINE:ID" for an unlisted station
    std::string line;
    std::uint8_t id = 0;
    BusClient* bus = nullptr;  ///< never null; outlives the reference
};

/// A write by any client: cached values of these items are stale from now on. Reported when the
/// request is sent and again when its attempt ends, before it is answered.
struct WriteEvent {
    std::uint8_t station = 0;           ///< 0: all stations of the line
    std::optional<modbus::Span> items;  ///< nullopt: any item may change
    bool ended = false;
    std::uint64_t client = 0;  ///< ClientId of the writer; 0: no client waits any more
};

/// Identifies a TCP connection, an HTTP session or an internal task. 0: no client.
using ClientId = std::uint64_t;
ClientId next_client_id();

/// One request to one station; station 0 is a broadcast.
struct Request {
    std::uint8_t station = 0;  ///< 0..255; above 247 only a listed one
    modbus::Request request;
    ClientId client = 0;
    WhoRef who{};       ///< null: nobody has said; then neither rights nor records know it
    bool poll = false;  ///< lowest priority, after clients' requests
    /// The client's own deadline, from arrival; the line's queue deadline applies if it is sooner.
    Duration within = Duration::max();
    /// A station search with a limited share of the line: may ask silent unlisted stations again.
    bool search = false;
    bool raw = false;  ///< a PDU that its client has made itself, as REST's `raw`
    /// The client takes the reply's bytes as they are: `any_length` of the station counts. Other
    /// clients cut values out of the reply, which must then be as long as was asked.
    bool verbatim = false;
};

enum class Source : std::uint8_t { bus, cache };

/// The only answer to a request: a reply PDU (normal or the panel's exception) or a fault. For a
/// broadcast the PDU is the function's normal reply, made here when the frame has been sent.
struct Answer {
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< at least part of the request was on the wire
    Source source = Source::bus;
    Duration age{};       ///< of the cached value, if source is cache
    bool shared = false;  ///< answered by another request's transaction
    /// Set if the gateway refused the request without transmitting it: `pdu` is Fault::denied, or a
    /// guard's exception.
    std::optional<Refusal> refusal{};
    std::string why{};  ///< for Fault::line_down: the cause, as in the line's state
    arbiter::TransactionNumbers transactions{};  ///< the line's transactions made for this request
};
using AnswerHandler = InlineFunction<void(Answer), 48>;

/// What a client has requested of a line, and how much of its time it used (P9).
struct ClientShare {
    /// "modbus_tcp 10.0.0.7:51234"; once the client has left without the port, and of IPv6 the /64.
    std::string name;
    Duration busy{};
    double percent = 0;  ///< of the line's total busy time
    std::uint64_t transactions = 0;
    std::optional<std::string> address{};  ///< without the port; nullopt: not a server's client
    std::uint64_t requests = 0;
    std::uint64_t failed = 0;             ///< failed requests, including exceptions
    std::optional<Outcome> last_error{};  ///< outcome of the last failed request
    Duration last_error_ago{};
    std::optional<Duration> gone{};  ///< time since the client left; nullopt: connected
};

/// Disconnected clients remain listed by their hosts (name_of_host()).
struct ClientSettings {
    Duration remembered_for = 10min;
    std::size_t remembered =
        256;  ///< maximum number of names; the client that left first is dropped
};

/// Name of the row for everything else: clients without a row of their own, and the gateway's
/// probes.
constexpr std::string_view kOtherClients = "others";

/// A cause of errors that the line doctor has found.
struct LineFinding {
    std::string cause;                    ///< "wrong-baud"…: stable identifiers
    std::optional<std::uint8_t> station;  ///< station id; nullopt: the whole line
    std::string text;
    std::string advice;
    std::string evidence;  ///< the numbers behind it
    std::string name{};    ///< the station's configured name; empty: the whole line
    /// The numbers in these texts: counts, and durations in milliseconds ("timeout_ms").
    std::map<std::string, std::uint64_t> figures{};
};

struct LineStatus {
    std::string name;
    std::string device;
    bool up = false;
    std::string
        state;  ///< "up", or the cause: "down: cannot open /dev/x: No such file or directory"
    std::size_t queue_depth = 0;
    double load_percent = 0;  ///< busy share of the last ten seconds, independent of polling
    EchoState echo = EchoState::unknown;
    std::vector<LineFinding> findings{};  ///< most likely first; none on a healthy line
    bool listens = false;  ///< listen mode: another master drives the line, nothing is sent
};

/// What was heard of one station on a line in listen mode.
struct HeardCounts {
    std::uint64_t requests = 0;  ///< sent by the line's master
    std::uint64_t replies = 0;   ///< normal replies
    std::uint64_t exceptions = 0;
    std::uint64_t timeouts = 0;  ///< the master went on without a reply
    std::uint64_t damaged = 0;
    std::uint64_t doubtful = 0;  ///< replies or requests that may be another's, an echo or a copy
    Duration think{};            ///< time from the last request to its reply
    Duration longest_think{};
};

struct StationStatus {
    /// `unknown` while the line is down.
    Health state = Health::unknown;
    std::optional<Duration> last_success;  ///< time since then; late replies do not count
    /// How often the station or its line came back: each may have been a restart.
    std::uint64_t returns = 0;
    std::optional<Duration> last_reply{};  ///< time since then, late replies included
    std::optional<HeardCounts> heard{};    ///< in listen mode only
    std::optional<Condition> condition{};  ///< not in listen mode, where nothing is asked
};

/// A line as its clients ask it: servers, REST, the poller, relays, a discovery. Single-threaded.
class RequestPort {
  public:
    virtual ~RequestPort() = default;

    /// Submits a request. The handler is called exactly once, never from inside transact(), and at
    /// the latest at the line's queue deadline. Refuses what cannot be answered at this address
    /// (Fault::denied), what the rights forbid (Answer::refusal), and what does not fit in the
    /// queue (Fault::busy).
    virtual void transact(Request request, AnswerHandler handler) = 0;
    /// Returns why transact() would refuse every write to this station (0: every broadcast), if so.
    /// For callers that must know before the write is complete, or before they ask other lines.
    virtual std::optional<Refusal> write_refusal(std::uint8_t /*station*/) const {
        return std::nullopt;
    }
    /// Returns why transact() would refuse this request (0: a broadcast), if so: for callers that
    /// ask other lines, or for other items, as well.
    virtual std::optional<Refusal> refusal_of(const Request& request) const {
        if (request.request.is_read()) return std::nullopt;
        return write_refusal(request.station);
    }
    /// Counts (and logs, if it is a write) a request that the caller refused before submitting it:
    /// a PDU that contradicts its function, or a write on a read-only listener.
    virtual void count_refused(std::uint8_t /*station*/, ByteView /*pdu*/, const WhoRef& /*who*/) {}
    /// Counts what the caller refused by a rule of `access`, without asking the line.
    virtual void count_denied(std::string_view /*rule*/) {}
    /// Removes a client: its waiting requests are answered Fault::cancelled and never transmitted;
    /// a request on the wire completes and is answered normally.
    virtual void cancel(ClientId client) = 0;
    /// Sets the client's name for clients() and the trace, until cancel(). The last name applies.
    virtual void name_client(ClientId /*client*/, std::string /*name*/) {}
};

/// What is known of a line: for REST, metrics and the diagnostics unit. Nothing is sent.
class LineView {
  public:
    virtual ~LineView() = default;

    virtual LineStatus status() const = 0;
    /// Returns each client's use of the line, largest first, at most 100 rows, then a row for the
    /// rest. Their sum is the line's total.
    virtual std::vector<ClientShare> clients() const { return {}; }
    virtual StationStatus station_status(std::uint8_t station) const = 0;
    /// Returns the outcomes of all requests to a listed station.
    virtual OutcomeCounts outcomes(std::uint8_t /*station*/) const { return {}; }
    /// Returns the last frames, decisions and finished transactions, oldest first, at most `last`
    /// of each.
    virtual TracePart trace(std::size_t last) const = 0;
    /// Returns the first entries after this sequence number, oldest first, at most `most` of each.
    virtual TracePart trace_since(std::uint64_t /*sequence*/, std::size_t /*most*/) const {
        return {};
    }
    /// Returns the recorded incidents, oldest first, at most IncidentSettings::incidents.
    virtual std::vector<IncidentHead> incidents() const { return {}; }
    /// Returns an incident and marks it as read; nullopt if the incident is not recorded.
    virtual std::optional<Incident> incident(std::uint64_t /*id*/) { return std::nullopt; }
    /// True if `who` may read something of this station (0: of the line), by the rules of `access`.
    virtual bool tells(const WhoRef& /*who*/, std::uint8_t /*station*/) const { return true; }
};

/// Both. A bus lives as long as the program's io_context runs, and outlives its clients.
class BusClient : public RequestPort, public LineView {};

struct Settings;

/// A line as managed by the program: driven (Bus), or only listened to (ListeningBus).
class LineBus : public BusClient {
  public:
    virtual void start() = 0;
    /// Closes the line.
    virtual void stop() = 0;
    /// Applies new settings. Outstanding replies, counters, records and learned state stay, except
    /// for stations no longer listed. `line` replaces the current line as soon as that waits for no
    /// reply; until the new line is open, requests stay queued. `far_end` is kept until the current
    /// line is closed. A null `line` keeps the current one: only where is_same_wire().
    virtual void apply(Settings settings, std::unique_ptr<line::Line> line,
                       std::shared_ptr<void> far_end) = 0;
    /// Doors have changed (Settings::admit): refuses what waits and would not be let in now.
    virtual void judge_waiting() {}
    /// Returns when no request sent on this wire can still be answered (P1).
    virtual TimePoint clear_at() const { return {}; }
    /// Sends no request before `until`.
    virtual void rest_until(TimePoint /*until*/) {}
    virtual LineReport report() const = 0;
};

}  // namespace panelgate::bus
