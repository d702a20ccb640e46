#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/bus/line_history.hpp"

namespace panelgate::bus {

/// What the clients of one address used of a line.
struct HostUse {
    std::string
        name;  ///< HostKey::text(); of a client without an address its name: "poll of press"
    std::uint64_t requests = 0;
    std::uint64_t failed = 0;
    Duration busy{};     ///< time of the line
    double percent = 0;  ///< of the time that the line was busy
    std::optional<Outcome> last_error{};
    Duration last_error_ago{};
};

/// What was used of a line in the last minute.
struct MinuteUse {
    Duration span{};          ///< 60 to 70 s; less in the first minute
    double load_percent = 0;  ///< 0..100
    RequestCounts all;
    std::map<std::string, RequestCounts> stations;  ///< by name; of those that were asked
    std::vector<HostUse> hosts;                     ///< who asked, the largest share first
    bool refuses = false;  ///< requests found no turn in each ten seconds of a whole minute
};

/// Counters of a line a minute ago, to compare with the present ones. Bounded. Pure.
class LastMinute {
  public:
    static constexpr Duration kStep = 10s;

    /// Call each kStep.
    void record(TimePoint now, const LineReport& report, const std::vector<ClientShare>& clients);
    /// Compares the present counters with those of a minute ago.
    MinuteUse use(TimePoint now, const LineReport& report,
                  const std::vector<ClientShare>& clients) const;

  private:
    struct Mark {
        TimePoint at;
        Duration busy{};
        RequestCounts all;
        std::map<std::string, RequestCounts> stations;
        std::map<std::string, HostUse> hosts;
    };
    static Mark mark_of(TimePoint at, const LineReport& report,
                        const std::vector<ClientShare>& clients);

    std::deque<Mark> marks_;  ///< the oldest first; at most seven
};

}  // namespace panelgate::bus
