#pragma once

#include <map>
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

}  // namespace panelgate::web
