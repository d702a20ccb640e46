#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// Gathers what one client tries again and again without effect, so that it cannot push what had an
/// effect out of the files: the first ones are recorded in full, further ones are counted. The
/// count is recorded after a second, then after two, four, ... so that a crash loses little of it,
/// and at last once in an interval. Bounded for each client, and for all together: what finds no
/// place shares one. Pure.
class Repeats {
  public:
    static constexpr Duration kInterval = 1min;
    static constexpr Duration kFirst = 1s;  ///< until the first count is recorded
    static constexpr std::size_t kMost = 1024;
    static constexpr std::size_t kMostOfOne = 64;  ///< keys of one client
    /// New keys of all clients together: so many at once, and then one in so much time.
    static constexpr int kNewAtOnce = 256;
    static constexpr Duration kNewEach = 5s;

    /// What was counted under one key.
    struct Counted {
        std::string members;  ///< as given with the first one
        std::uint64_t count = 0;
        WallTime first{};
        WallTime last{};
    };

    /// A client, by the beginning of its keys. What finds no place among its keys shares one, of
    /// which nothing is recorded in full.
    struct Client {
        std::string_view key;                  ///< empty: without a limit
        std::function<std::string()> members;  ///< that tell who it is
    };

    /// True if this one is to be recorded in full: one of the first `in_full` of its interval;
    /// otherwise it was counted. `members` makes the JSON members that tell what is repeated
    /// (`,"client":"..."`), for a new key.
    bool is_new(TimePoint now, WallTime wall, std::string_view key, unsigned in_full,
                const std::function<std::string()>& members, const Client& client = {});
    /// Takes the counts that are to be recorded now; `all`: all of them.
    std::vector<Counted> due(TimePoint now, bool all = false);
    bool empty() const { return entries_.empty(); }

  private:
    bool has_many(std::string_view client) const;
    bool may_begin(TimePoint now);

    struct Entry {
        TimePoint since{};  ///< its count was recorded, or it began
        unsigned in_full = 0;
        Counted counted;
        Duration step = kFirst;  ///< until the count is recorded
    };
    std::map<std::string, Entry, std::less<>> entries_;
    int room_ = kNewAtOnce;  ///< for new keys
    TimePoint filled_{};     ///< `room_` counts from then on
};

}  // namespace panelgate::audit
