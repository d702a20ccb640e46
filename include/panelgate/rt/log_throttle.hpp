#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

using LogField = std::pair<std::string_view, std::string>;

/// An event in words, without its time.
struct LogLine {
    std::string text;
    std::string fields{};  ///< the same for the journal (journal.hpp); empty where it is not asked
};

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

/// Repeats are quoted now and then: the same event of the same subject passes a few times, and then
/// once in a while with how often it was left out. As subjects may be chosen by a client
/// (addresses, topics), each client and each event has a budget besides: beyond it lines are left
/// out and counted. Bounded. Pure.
class LogThrottle {
  public:
    /// So many at once, then one an interval.
    struct Pace {
        int burst;
        Duration interval;
    };
    static constexpr Pace kIncidents{3, 10min};  ///< nine lines an hour of what never ends
    static constexpr Pace kDeeds{30, 1min};      ///< what people do, and programs without end
    static constexpr Pace kByClient{60, 1s};     ///< an event of one client, whatever its subjects
    static constexpr Pace kByEvent{600, 100ms};  ///< an event of all clients
    static constexpr Duration kLeftOutPause = 1min;
    static constexpr std::size_t kMostSubjects = 1024;
    static constexpr std::size_t kMostClients = 256;

    /// Nothing: this one is left out. Else how many were since the last one that passed. `client`
    /// has no port; empty: the event is of no client.
    std::optional<std::uint64_t> pass(TimePoint now, std::string_view event,
                                      std::string_view subject, const Pace& pace = kIncidents,
                                      std::string_view client = {});

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

    /// How many lines went beyond a budget; `client` is empty where it was the event's.
    struct LeftOut {
        std::string event;
        std::string client;
        std::uint64_t count = 0;
    };
    /// Those that have waited for kLeftOutPause; each is told once.
    std::vector<LeftOut> take_left_out(TimePoint now);

  private:
    struct Seen {
        TimePoint last;  ///< passed
        Duration interval{};
        int credit = 0;
        std::uint64_t left_out = 0;
        LogLevel level = LogLevel::info;
        std::optional<LogLine> held{};  ///< of those left out the last
    };
    struct Budget {
        std::string event;
        std::string client;
        TimePoint filled;
        int credit = 0;
        std::uint64_t left_out = 0;
        TimePoint since;  ///< the first that is left out and not yet told
    };
    using Budgets = std::map<std::string, Budget, std::less<>>;

    Seen& new_subject(TimePoint now, std::string key, const Pace& pace);
    void make_room(TimePoint now);
    bool is_within_budget(TimePoint now, std::string_view event, std::string_view client);
    static Budget& budget(Budgets& budgets, TimePoint now, std::string_view event,
                          std::string_view client, const Pace& pace);
    void make_room_for_client(TimePoint now);

    std::map<std::string, Seen, std::less<>> seen_;
    Budgets of_clients_;
    Budgets of_events_;
};

}  // namespace panelgate::rt
