#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Counts the wrong tokens of each address, so that nobody can try many. The minute of an address
/// begins with its first wrong token. Pure.
class WrongTokens {
  public:
    explicit WrongTokens(const WrongTokenSettings& settings) : settings_(settings) {}
    void apply(const WrongTokenSettings& settings) { settings_ = settings; }

    void add(TimePoint now, const HostKey& host);
    /// Returns for how long no token of the address is judged any more; zero: its tokens are
    /// judged.
    Duration barred_for(TimePoint now, const HostKey& host) const;

  private:
    struct Count {
        unsigned wrong = 0;
        TimePoint since;  ///< the first wrong token of the minute
    };

    WrongTokenSettings settings_;
    std::map<HostKey, Count> counts_;
};

/// Decides which connections stay when limits are reached: in all and per address. Event streams
/// stay open all day, so streams have a limit of their own and are never displaced. A new
/// connection displaces, if its address is at its limit, that address's longest-idle connection;
/// if all places are taken, the longest-idle connection of all. If none is idle, a few extra places
/// answer probes only, and the newest connection there displaces the oldest. A client that speaks
/// TLS arrives when its handshake is over: before, it displaces nobody. Pure.
class Places {
  public:
    using Id = std::uint64_t;
    struct Arrival {
        bool probes_only = false;
        std::optional<Id> leaves;  ///< displaced connection, to be closed
    };

    explicit Places(const Settings& settings) { apply(settings); }
    /// Applies new limits to connections that arrive later.
    void apply(const Settings& settings);

    Arrival arrive(Id id, const HostKey& host);
    /// A complete request has arrived: the connection keeps its place until idle(). These calls
    /// ignore unknown ids.
    void busy(Id id);
    /// Marks it as an event stream. False if its address has reached its limit of streams.
    bool stream(Id id);
    void idle(Id id);
    void leave(Id id) { guests_.erase(id); }

  private:
    enum class State : std::uint8_t { idle, busy, streaming };
    struct Guest {
        HostKey host;
        bool probes_only = false;
        State state = State::idle;
        std::uint64_t since = 0;  ///< turn at which it became idle or arrived
    };
    void set(Id id, State state);
    /// Counts the connections of a kind of place, of all or of one address.
    std::size_t count(bool probes_only, const HostKey* host = nullptr) const;
    std::size_t streams(const HostKey& host) const;
    /// Returns the longest-idle connection, of all or of one address.
    std::optional<Id> longest_idle(bool probes_only, const HostKey* host = nullptr) const;

    std::size_t limit_ = 0;
    std::size_t limit_of_address_ = 0;
    std::size_t limit_of_streams_ = 0;
    std::size_t limit_of_probes_ = 0;
    std::map<Id, Guest> guests_;
    std::uint64_t turn_ = 0;
};

}  // namespace panelgate::web
