#pragma once

#include <map>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Who guesses tokens is slowed down, by address. What is right is held up as what is wrong, or the
/// time would tell them apart; never for long, and each right one makes up for a wrong one: behind
/// one address there may be many. Pure.
class Logins {
  public:
    explicit Logins(const LoginSettings& settings) : settings_(settings) {}

    /// How long a request with a token waits before anybody looks at it.
    Duration hold(TimePoint now, const std::string& address) const;
    void failed(TimePoint now, const std::string& address);
    void succeeded(const std::string& address);
    std::size_t addresses() const { return known_.size(); }

  private:
    struct Failures {
        unsigned count = 0;
        TimePoint last;
    };
    unsigned count_at(TimePoint now, const Failures& failures) const;

    LoginSettings settings_;
    std::map<std::string, Failures> known_;
};

}  // namespace panelgate::web
