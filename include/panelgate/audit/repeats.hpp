#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panelgate/audit/record.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// Gathers what one client tries again and again without effect, so that the client cannot push
/// what had an effect out of the files: the first attempt is recorded in full, further ones are
/// counted, and the count is recorded once in an interval. Bounded: attempts of a client beyond
/// kMostOfOne different ones are counted together, and so are clients beyond kClients. Pure.
class Repeats {
  public:
    static constexpr Duration kInterval = 1min;
    static constexpr std::size_t kClients = 64;
    static constexpr std::size_t kMostOfOne = 64;

    /// True if this attempt is to be recorded in full; otherwise the attempt was counted. `client`:
    /// members about the client; `what`: members about the attempt, the same for each repetition.
    bool is_new(TimePoint now, WallTime wall, const Members& client, const Members& what);
    /// Takes the counts of intervals that are over as members of records; `all`: all counts.
    std::vector<Members> due(TimePoint now, bool all = false);
    bool empty() const { return counts_.empty(); }

  private:
    struct Count {
        Members members;
        TimePoint since{};
        std::uint64_t times = 0;  ///< besides the one in full
        WallTime first{};
        WallTime last{};
    };
    /// By the text of who, and then of what.
    std::map<std::string, std::map<std::string, Count>> counts_;
};

}  // namespace panelgate::audit
