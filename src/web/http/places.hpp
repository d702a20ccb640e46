#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

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

}  // namespace panelgate::web
