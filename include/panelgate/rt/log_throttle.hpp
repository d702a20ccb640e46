#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

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

  private:
    struct Seen {
        TimePoint last;  ///< passed
        Duration interval{};
        int credit = 0;
        std::uint64_t left_out = 0;
    };
    void make_room(TimePoint now);

    std::map<std::string, Seen, std::less<>> seen_;
};

}  // namespace panelgate::rt
