#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Returns the host of "NAME", "NAME:PORT", "[ADDRESS]:PORT" in lower case, without brackets or a
/// trailing dot; nullopt if malformed.
std::optional<std::string> host_of_authority(std::string_view authority);
/// Returns its port, "" if there is none.
std::string port_of_authority(std::string_view authority);

/// Returns this machine's own names, without a DNS query.
std::vector<std::string> machine_names();

/// The names under which the server may be addressed: protects against DNS rebinding, since a
/// rebound page sends its own name and browsers let no page choose another. Pure.
class HostNames {
  public:
    HostNames(const Settings& settings, const std::vector<std::string>& machine);

    /// True for a name of ours. `host` comes from host_of_authority(), `local` is the connection's
    /// local address. That address, the listen address and the loopback (address and name) are
    /// always accepted.
    bool knows(const std::string& host, const boost::asio::ip::address& local) const;
    /// True for a configured name, where a proxy may use another port.
    bool is_configured(const std::string& host) const { return configured_.contains(host); }

  private:
    std::set<std::string> names_;
    std::set<std::string> configured_;
    std::set<boost::asio::ip::address> addresses_;
};

/// Checks a request for anything not public. 421 if it is for another host (`request.host`;
/// HTTP/1.0 may have none). 403 if the browser reports a page of another site, unless the user
/// follows a link to one of our pages; and for a foreign Origin, except with OPTIONS. Pages of the
/// origins in `readers` (lower case) may read.
std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local,
                                    const std::vector<std::string>& readers);

/// Slows down token guessing, per address. The reply to a wrong token is delayed, a right one's is
/// not; since that difference already shows, an address that guesses has its requests checked one
/// at a time, at a fixed rate, so hanging up early gains nothing. The delay is so much longer than
/// that interval that even a few dozen waiting guessers leave turns for right tokens. Each right
/// token cancels a wrong one, since many users may share an address. Pure.
class Logins {
  public:
    explicit Logins(const LoginSettings& settings) : settings_(settings) {}
    void apply(const LoginSettings& settings) { settings_ = settings; }

    /// Returns how long a request with a token waits before it is checked, and takes that turn.
    Duration turn(TimePoint now, const std::string& address);
    /// Returns how long the reply to a wrong token is then delayed.
    Duration hold(TimePoint now, const std::string& address) const;
    void failed(TimePoint now, const std::string& address);
    void succeeded(const std::string& address);
    std::size_t addresses() const { return known_.size(); }

  private:
    struct Failures {
        unsigned count = 0;
        TimePoint last;
        TimePoint free{};  ///< when the next token may be checked
    };
    Duration pause() const;  ///< between two checks for an address
    bool guesses(TimePoint now, const Failures& failures) const;
    unsigned count_at(TimePoint now, const Failures& failures) const;

    LoginSettings settings_;
    std::map<std::string, Failures> known_;
};

/// Decides which connections stay when limits are reached: in all and per address. Event streams
/// stay open all day, so they have a limit of their own and are never displaced. A connection
/// throttled for a wrong token does not count against its address, which may have so many of them
/// besides: closing it would invite a retry. A new connection displaces, if its address is at its
/// limit, that address's longest-idle one; if its address has too many throttled ones, the one
/// throttled longest; if all places are taken, the one throttled longest, else the longest-idle
/// one, else an unchecked one of another guessing address. If none can be displaced, a few extra
/// places answer probes only, and the newest there displaces the oldest. A client that speaks TLS
/// arrives when its handshake is over: before, it displaces nobody. Pure.
class Places {
  public:
    using Id = std::uint64_t;
    struct Arrival {
        bool probes_only = false;
        std::optional<Id> leaves;  ///< displaced connection, to be closed
    };

    explicit Places(const Settings& settings);
    /// Applies new limits to connections that arrive later.
    void apply(const Settings& settings);

    Arrival arrive(Id id, const std::string& address);
    /// A complete request has arrived: the connection keeps its place until idle(). These calls
    /// ignore unknown ids.
    void busy(Id id);
    /// Its address guesses tokens and its own token is not checked yet: another address may
    /// displace it. Not the same address, or a guess could displace a right token.
    void suspect(Id id);
    /// Its token is wrong: it waits for the delayed refusal and is then closed.
    void wrong(Id id);
    /// Marks it as an event stream. False if its address has reached its limit of streams.
    bool stream(Id id);
    bool is_throttled(Id id) const;
    void idle(Id id);
    void leave(Id id);

  private:
    enum class State : std::uint8_t { idle, busy, suspect, wrong, streaming };
    struct Guest {
        std::string address;
        bool probes_only = false;
        State state = State::idle;
        std::uint64_t since = 0;  ///< turn at which it became idle or arrived
    };
    void set(Id id, State state);
    std::size_t probes() const;
    std::size_t guests() const;  ///< all but probes
    /// Counts an address's connections that are neither throttled nor streaming.
    std::size_t counted_connections(const std::string& address) const;
    std::size_t in_state(const std::string& address, State state) const;
    Arrival admit(const std::string& address) const;
    /// Returns the one longest in `state`, of all or of one address.
    std::optional<Id> longest(State state, bool probes_only,
                              const std::string* address = nullptr) const;
    std::optional<Id> suspect_of_another(const std::string& address) const;

    std::size_t limit_ = 0;
    std::size_t limit_of_address_ = 0;
    std::size_t limit_of_streams_ = 0;
    std::size_t limit_of_throttled_ = 0;
    std::size_t limit_of_probes_ = 0;
    std::map<Id, Guest> guests_;
    std::uint64_t turn_ = 0;
};

/// Limits an address's share of the loop's time, so that a client requesting without pause slows
/// neither the lines nor other addresses: each request costs time, and so does each byte produced
/// or sent. An address over its share and burst waits for its replies. Pure.
class RateLimiter {
  public:
    explicit RateLimiter(const RateLimitSettings& settings) : settings_(settings) {}
    void apply(const RateLimitSettings& settings) { settings_ = settings; }

    /// Charges a reply of `bytes`; returns how long it must wait.
    Duration take(TimePoint now, const std::string& address, std::size_t bytes);

  private:
    RateLimitSettings settings_;
    std::map<std::string, TimePoint> used_until_;  ///< by address; only future times matter
};

}  // namespace panelgate::web
