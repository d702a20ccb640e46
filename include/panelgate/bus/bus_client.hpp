#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/time.hpp"
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

/// Who a station is: what it is called, and where it is asked.
struct StationRef {
    std::string name;  ///< unique; "LINE:ID" for a station that the configuration does not list
    std::string line;
    std::uint8_t id = 0;
    BusClient* bus = nullptr;  ///< never null; outlives whoever refers to the station
};

/// Somebody writes, whoever it is: what is known of these items is old from now on. Told when the
/// request leaves and when its attempt is over, before it is answered.
struct WriteEvent {
    std::uint8_t station = 0;           ///< 0: all of the line
    std::optional<modbus::Span> items;  ///< nothing: it may change anything
    bool ended = false;
    std::uint64_t client = 0;  ///< whose it is (ClientId); 0: nobody waits for it any more
};

/// Who asks: one number a TCP connection, HTTP session or internal task. 0 is nobody's.
using ClientId = std::uint64_t;
ClientId next_client_id();
/// The same for all clients of one address; 0: the client is its own.
using Host = arbiter::Host;
/// Of an address without its port ("10.0.0.7"); never 0.
Host host_of(std::string_view address);

/// One request to one station; station 0 is a broadcast.
struct Request {
    std::uint8_t station = 0;  ///< 0..247
    modbus::Request request;
    ClientId client = 0;
    Host host = 0;      ///< the client's address (host_of()); 0: it is its own
    bool poll = false;  ///< of the lowest class: clients' own requests go first
    /// Its client waits no longer: its deadline, where that of the line's queue is not sooner.
    Duration within = Duration::max();
    /// The reply is waited for at least so long (within the response timeout): a station that
    /// nobody knows is otherwise not waited for longer than the line's others need.
    Duration patience{};
    /// A search for stations that keeps to a share of its own: it may ask silent strangers anew.
    bool search = false;
};

enum class Source : std::uint8_t { bus, cache };

/// The one answer to a request: a reply PDU (normal or the panel's exception), or a fault.
/// For a broadcast the PDU is the function's normal reply, forged when the frame has left.
struct Answer {
    Result<Bytes> pdu = Fault::cancelled;
    bool transmitted = false;  ///< the request was (at least partly) on the wire at least once
    Source source = Source::bus;
    Duration age{};       ///< of the value, when source is cache
    bool shared = false;  ///< another request's transaction answered this one, too
    /// It is refused here and never transmitted: `pdu` is Fault::denied, or a guard's exception.
    std::optional<Refusal> refusal{};
    std::string why{};  ///< of Fault::line_down: what is wrong with the line, as its state says
    arbiter::TransactionNumbers transactions{};  ///< of the line, that were made for it
};
using AnswerHandler = InlineFunction<void(Answer), 48>;

/// What one client has asked of a line, and used of its time (P9).
struct ClientShare {
    std::string name;  ///< "modbus_tcp 10.0.0.7:51234"; of those who have left, without a port
    Duration busy{};
    double percent = 0;  ///< of all the time that the line was busy
    std::uint64_t transactions = 0;
    std::optional<std::string> address{};  ///< without its port; nothing: it is no server's client
    std::uint64_t requests = 0;
    std::uint64_t failed = 0;             ///< of these, panels' exceptions too
    std::optional<Outcome> last_error{};  ///< of the last that failed
    Duration last_error_ago{};
    std::optional<Duration> gone{};  ///< how long ago it has left; nothing: it is there
};

/// Who has hung up is still shown, by its name without a port.
struct ClientSettings {
    Duration remembered_for = 10min;
    std::size_t remembered = 256;  ///< names at most; the one that left first gives way
};

/// The name of the row that has what no other has: of those who are shown no more, and of the
/// gateway's own probes.
constexpr std::string_view kOtherClients = "others";

/// What the line doctor takes for a cause of errors.
struct LineFinding {
    std::string cause;                    ///< "wrong-baud"…: stable words
    std::optional<std::uint8_t> station;  ///< its id; nothing: the whole line
    std::string text;
    std::string advice;
    std::string evidence;  ///< the numbers behind it
    std::string name{};    ///< of the station, as the configuration has it; empty: the whole line
    /// The numbers of these texts: counts, and durations in milliseconds ("timeout_ms").
    std::map<std::string, std::uint64_t> figures{};
};

struct LineStatus {
    std::string name;
    std::string device;
    bool up = false;
    std::string state;  ///< "up", or why not: "down: cannot open /dev/x: No such file or directory"
    std::size_t queue_depth = 0;
    double load_percent = 0;  ///< busy share of the last ten seconds, the same for all who ask
    EchoState echo = EchoState::unknown;
    std::vector<LineFinding> findings{};  ///< the likeliest first; none on a healthy line
    bool listens = false;                 ///< its master is somebody else: nothing is ever sent
};

/// What passed by of one station on a line that is only listened to.
struct HeardCounts {
    std::uint64_t requests = 0;  ///< of the line's master
    std::uint64_t replies = 0;   ///< normal ones
    std::uint64_t exceptions = 0;
    std::uint64_t timeouts = 0;  ///< its master went on without a reply
    std::uint64_t damaged = 0;
    std::uint64_t doubtful = 0;  ///< whose reply or echo it was, nobody can tell
    Duration think{};            ///< from the last request to its reply
    Duration longest_think{};
};

struct StationStatus {
    /// `unknown` while its line is down: what it does cannot be seen.
    Health state = Health::unknown;
    std::optional<Duration> last_success;  ///< how long ago; late replies are none
    /// How often it, or its line, was gone and came back: each may have been a restart.
    std::uint64_t returns = 0;
    std::optional<Duration> last_reply{};  ///< how long ago, late ones too
    std::optional<HeardCounts> heard{};    ///< on a line that is only listened to
};

/// What servers, REST and the poller see of a line: the bus seam. One thread. A bus lives as long
/// as the program's io_context runs; it outlives its clients.
class BusClient {
  public:
    virtual ~BusClient() = default;

    /// Hands in a request. The handler is called exactly once, never from inside transact(), at the
    /// latest at the deadline of the line's queue settings. Refuses what cannot be answered at this
    /// address (Fault::denied), what the rights forbid (Answer::refusal), and what has no place in
    /// the queue (Fault::busy).
    virtual void transact(Request request, AnswerHandler handler) = 0;
    /// Why transact() would refuse every write to this station (0: every broadcast), if it would.
    /// For those who have to say so before they know the write, or before they ask other lines.
    virtual std::optional<Refusal> refusal_of_write(std::uint8_t station) const {
        static_cast<void>(station);
        return std::nullopt;
    }
    /// Counts (and, of a write, logs) as refused what never became a request, because whoever was
    /// asked has refused it: a PDU that contradicts its function, a listener only for reads.
    virtual void tell_refused(std::uint8_t station, ByteView pdu, ClientId client) {
        static_cast<void>(station);
        static_cast<void>(pdu);
        static_cast<void>(client);
    }
    /// Forgets a client: its waiting requests are answered Fault::cancelled and never transmitted;
    /// one on the wire is completed and then answered normally.
    virtual void cancel(ClientId client) = 0;

    virtual LineStatus status() const = 0;
    /// What each client has used of the line: the greediest first, at most 100, and behind them
    /// what no other row has. Together they are what the line has done.
    virtual std::vector<ClientShare> clients() const { return {}; }
    virtual StationStatus station_status(std::uint8_t station) const = 0;
    /// What became of all requests to a station that the configuration lists.
    virtual OutcomeCounts outcomes(std::uint8_t station) const {
        static_cast<void>(station);
        return {};
    }
    /// The last frames, decisions and transactions that are over, oldest first, at most `last` of
    /// each.
    virtual TracePart trace(std::size_t last) const = 0;
    /// The first of each that follow this sequence number, oldest first, at most `most` of each.
    virtual TracePart trace_since(std::uint64_t sequence, std::size_t most) const {
        static_cast<void>(sequence);
        static_cast<void>(most);
        return {};
    }
    /// What has gone wrong and is kept, the oldest first: at most IncidentSettings::incidents.
    virtual std::vector<IncidentHead> incidents() const { return {}; }
    /// One of them, which has been read then; nothing: it is not kept.
    virtual std::optional<Incident> incident(std::uint64_t id) {
        static_cast<void>(id);
        return std::nullopt;
    }
    /// What a client is to be called in clients() and in the trace, until cancel(). The last name
    /// counts.
    virtual void name_client(ClientId client, std::string name) {
        static_cast<void>(client);
        static_cast<void>(name);
    }
};

struct Settings;

/// What the program starts, stops and counts: a line that is driven (Bus), or one that is only
/// listened to (ListeningBus).
class LineBus : public BusClient {
  public:
    virtual void start() = 0;
    /// Closes the line.
    virtual void stop() = 0;
    /// Goes on with these. What is owed, counted, recorded and known stays, but for stations that
    /// are no longer listed. `line` takes the place of the one before as soon as that waits for no
    /// reply; meanwhile and until it is open requests wait for their turn. `far_end` is kept until
    /// the one before is closed. Null, the same line goes on: only where is_same_wire().
    virtual void apply(Settings settings, std::unique_ptr<line::Line> line,
                       std::shared_ptr<void> far_end) = 0;
    /// From when on nothing that was asked on its wire can still be answered there (P1).
    virtual TimePoint clear_at() const { return {}; }
    /// Nothing is asked before then.
    virtual void rest_until(TimePoint until) { static_cast<void>(until); }
    virtual LineReport report() const = 0;
};

}  // namespace panelgate::bus
