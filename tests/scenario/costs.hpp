#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/arbiter/queue/read_cache.hpp"
#include "plan.hpp"
#include "watch.hpp"

namespace panelgate::scenario {

/// One request on the wire, as anybody sees it.
struct Attempt {
    std::uint8_t station = 0;
    TimePoint started;
    TimePoint sent;           ///< its computed end
    bool dead = false;        ///< its panel could not answer
    bool was_silent = false;  ///< the station was silent before
    bool answered = true;
    bool read = false;
    bool heard = false;      ///< anything
    bool like_echo = false;  ///< a write whose confirmation equals the request
    bool again = false;      ///< it was on the wire before
    bool owed = false;       ///< an earlier one may still be answered
    std::optional<arbiter::ReadSpan> span;
};

/// P4: what those who do not answer cost the others.
class Costs {
  public:
    Costs(const Plan& plan, const Watch& watch);

    /// What an unanswered attempt may cost while others wait.
    Duration limit(const Attempt& attempt) const;
    /// It has cost this much when the next one goes; `wanted`: others wanted the line. Nothing, or
    /// what was broken.
    std::string on_unanswered(TimePoint now, const Attempt& attempt, bool wanted);
    void on_answered(TimePoint now, const Attempt& attempt);
    std::string at_end(Duration elapsed) const;
    /// Of the line, by those who never do anything wrong.
    double good_share(Duration elapsed) const;

  private:
    Duration frames(const Attempt& attempt) const;
    /// One silence that nobody could foresee.
    Duration surprise() const;

    arbiter::Settings settings_;
    const Watch& watch_;
    unsigned mortals_ = 0;  ///< stations that are dead at times
    double deaths_ = 0;     ///< a second
    bool scanned_ = false;
    Duration dead_{};  ///< all attempts at dead stations together
    Duration level_{};
    TimePoint level_at_{};
    Duration good_{};
};

}  // namespace panelgate::scenario
