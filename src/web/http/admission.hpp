#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Who guesses tokens is slowed down, by address. A wrong one is answered late. What is right is
/// not, and that tells it apart before the answer of a wrong one comes; so an address that guesses
/// is looked at one request at a time, at a fixed pace: hanging up early wins nothing. The hold is
/// so much longer than the pace that a few dozen who wait for their answers leave turns for what is
/// right. Each right one makes up for a wrong one: behind one address there may be many. Pure.
class Logins {
  public:
    explicit Logins(const LoginSettings& settings) : settings_(settings) {}
    void apply(const LoginSettings& settings) { settings_ = settings; }

    /// How long a request with a token waits before anybody looks at it: its turn is taken.
    Duration turn(TimePoint now, const std::string& address);
    /// How long a wrong one waits for its answer then.
    Duration hold(TimePoint now, const std::string& address) const;
    void failed(TimePoint now, const std::string& address);
    void succeeded(const std::string& address);
    std::size_t addresses() const { return known_.size(); }

  private:
    struct Failures {
        unsigned count = 0;
        TimePoint last;
        TimePoint free{};  ///< when the next request with a token may be looked at
    };
    Duration pause() const;  ///< between two turns of an address
    bool guesses(TimePoint now, const Failures& failures) const;
    unsigned count_at(TimePoint now, const Failures& failures) const;

    LoginSettings settings_;
    std::map<std::string, Failures> known_;
};

/// Who may stay when many want to: so many connections, so many of them an address; those that
/// stream events are open all day, have a limit of their own and never give way. Whoever is held
/// for a wrong token takes no place of its address, which may have so many held besides: to be
/// closed would tell it to try again. Who comes to a full house displaces, in this order: of an
/// address without a place, whoever of it has had no request for longest; of one with too many
/// held, the one that is held for longest; of a full house, the one held for longest, then the one
/// without a request for longest, then one that waits to be looked at and is of another address
/// that guesses. Where nobody gives way there are a few places more that answer probes, and the
/// newest of these displaces the oldest. Pure.
class Places {
  public:
    using Id = std::uint64_t;
    struct Arrival {
        bool probes_only = false;
        std::optional<Id> leaves;  ///< has no place any more: to be closed
    };

    explicit Places(const Settings& settings);
    /// For who comes from now on.
    void apply(const Settings& settings);

    Arrival arrive(Id id, const std::string& address);
    /// A whole request is here: nobody takes its place before idle(). These do nothing for who has
    /// none.
    void busy(Id id);
    /// Its address guesses tokens and its own has not been looked at: another address may take its
    /// place. Not the same one, or a guess could displace what is right.
    void suspect(Id id);
    /// It waits for no more than to be told that its token is wrong, and is closed then.
    void wrong(Id id);
    /// From now on it streams events. False when its address has as many streams as it may have.
    bool stream(Id id);
    bool is_held(Id id) const;
    void idle(Id id);
    void leave(Id id);

  private:
    enum class State : std::uint8_t { idle, busy, suspect, wrong, streaming };
    struct Guest {
        std::string address;
        bool probes_only = false;
        State state = State::idle;
        std::uint64_t since = 0;  ///< turn at which it became idle, or came
    };
    void set(Id id, State state);
    std::size_t probes() const;
    std::size_t guests() const;  ///< other than probes
    /// Of an address: neither held nor streaming.
    std::size_t placed(const std::string& address) const;
    std::size_t in_state(const std::string& address, State state) const;
    Arrival admit(const std::string& address) const;
    /// Of all, or of one address.
    std::optional<Id> longest(State state, bool probes_only,
                              const std::string* address = nullptr) const;
    std::optional<Id> suspect_of_another(const std::string& address) const;

    std::size_t limit_ = 0;
    std::size_t limit_of_address_ = 0;
    std::size_t limit_of_streams_ = 0;
    std::size_t limit_of_held_ = 0;
    std::size_t limit_of_probes_ = 0;
    std::map<Id, Guest> guests_;
    std::uint64_t turn_ = 0;
};

/// What an address may have of the loop's time, so that whoever asks without a pause slows neither
/// the lines nor other addresses: each request takes some of it, and so does each byte that is made
/// or sent. Who has used up its share and a burst waits before it is answered. Pure.
class Ration {
  public:
    explicit Ration(const RationSettings& settings) : settings_(settings) {}
    void apply(const RationSettings& settings) { settings_ = settings; }

    /// A request is answered with `bytes`. How long it has to wait for that.
    Duration take(TimePoint now, const std::string& address, std::size_t bytes);

  private:
    RationSettings settings_;
    std::map<std::string, TimePoint> used_until_;  ///< by address, those in the future
};

}  // namespace panelgate::web
