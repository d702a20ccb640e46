#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate::web {

/// A station that nobody had listed.
struct DiscoveredStation {
    std::uint8_t id = 0;
    std::vector<std::string> profiles;  ///< that explain what it answers, the best first
    std::string evidence;               ///< for people
};

/// What a search for stations has come to.
struct DiscoveryReport {
    enum class State : std::uint8_t { never, running, done, stopped };
    State state = State::never;
    unsigned share_percent = 0;  ///< of the line's time, at most
    std::size_t asked = 0;       ///< addresses
    std::size_t refused = 0;     ///< addresses that the line would not ask
    std::size_t of = 0;
    std::optional<Duration> remaining;        ///< at the pace so far; nothing: not known
    std::vector<DiscoveredStation> stations;  ///< so far
    std::string yaml;                         ///< to paste below `stations:`; "" without any
    Duration bus{};                           ///< what it has cost of the line's time
    Duration took{};
    std::string why;  ///< of State::stopped
};
std::string_view label(DiscoveryReport::State state);

/// Looks for stations on lines that run, by reads only. One thread.
class DiscoverySource {
  public:
    virtual ~DiscoverySource() = default;
    /// Begins to look on a line that there is. `stations`: "5,17,20-31"; listed ones among them are
    /// left out. What is wrong with that list, if anything; then nothing has begun.
    virtual std::optional<std::string> start(std::string_view line, std::string_view stations,
                                             unsigned share_percent) = 0;
    /// Ends it; what was found stays. Nothing happens where none runs.
    virtual void stop(std::string_view line) = 0;
    /// Of the last one on this line.
    virtual DiscoveryReport report(std::string_view line) const = 0;
};

}  // namespace panelgate::web
