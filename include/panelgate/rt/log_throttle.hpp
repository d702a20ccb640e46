#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/log_line.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

/// Whoever repeats himself is quoted now and then: the same event of the same subject passes a few
/// times, and then once in a while with how often it was left out. Pure.
class LogThrottle {
  public:
    /// So many at once, then one an interval.
    struct Pace {
        int burst;
        Duration interval;
    };
    static constexpr Pace kIncidents{3, 10min};  ///< nine lines an hour of what never ends
    static constexpr Pace kDeeds{30, 1min};      ///< what people do, and programs without end
    static constexpr std::size_t kMostSubjects = 1024;

    /// Nothing: this one is left out. Else how many were since the last one that passed.
    std::optional<std::uint64_t> pass(TimePoint now, std::string_view event,
                                      std::string_view subject, const Pace& pace = kIncidents);

    /// The last one that was left out, and how many before it.
    struct Held {
        LogLevel level = LogLevel::info;
        LogLine line;
        std::uint64_t left_out = 0;
    };
    /// Keeps the one that pass() has just left out: what came last is to be told when nothing
    /// follows.
    void hold(std::string_view event, std::string_view subject, LogLevel level, LogLine line);
    /// Those whose interval is over; each stands for all before it.
    std::vector<Held> take_held(TimePoint now);

  private:
    struct Seen {
        TimePoint last;  ///< passed
        Duration interval{};
        int credit = 0;
        std::uint64_t left_out = 0;
        LogLevel level = LogLevel::info;
        std::optional<LogLine> held{};  ///< of those left out the last
    };
    void make_room(TimePoint now);

    std::map<std::string, Seen, std::less<>> seen_;
};

}  // namespace panelgate::rt
