#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/base/wall_time.hpp"
#include "panelgate/rt/log_line.hpp"

namespace panelgate::rt {

/// For what must be in the log each time: all of it is told at once, but what is exactly the same
/// as the last at its place, soon after it, is gathered in one line. Nothing is lost: what a line
/// gathers differs in nothing but its time. Bounded. Pure.
class LogRepeats {
  public:
    static constexpr Duration kInterval = 1min;  ///< so long one line gathers
    static constexpr std::size_t kMostPlaces = 1024;

    /// Is this the same as the last at its place? It is to be gathered then, else to be told.
    bool is_repeat(TimePoint now, std::string_view place, std::string_view what);
    /// Keeps the repeat of which is_repeat() has just been true.
    void gather(std::string_view place, LogLine line, WallTime time);

    struct Gathered {
        LogLine line;  ///< the last one
        std::uint64_t repeated = 0;
        WallTime first{};
        WallTime last{};
    };
    /// What is to be told before anything else, as something else has followed.
    std::vector<Gathered> take_ended();
    /// What has gathered for kInterval.
    std::vector<Gathered> take_due(TimePoint now);

  private:
    struct Last {
        std::string what;
        TimePoint told;
        Gathered gathered{};
    };
    void end(Last& last);
    void make_room();

    std::map<std::string, Last, std::less<>> places_;
    std::vector<Gathered> ended_;
};

}  // namespace panelgate::rt
