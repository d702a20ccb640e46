#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

using LogField = std::pair<std::string_view, std::string>;

/// A formatted event, without its time.
struct LogLine {
    std::string text;
    std::string fields{};  ///< for the journal (log_output.hpp); empty if not needed
};

/// For events that must all be logged: each is logged at once, but repeats of the last one at its
/// place are merged into one line for kInterval. Nothing is lost: merged events differ only in
/// time. Bounded. Pure.
class LogRepeats {
  public:
    static constexpr Duration kInterval = 1min;  ///< how long one line merges repeats
    static constexpr std::size_t kMostPlaces = 1024;

    /// True if this repeats the last event at its place: then gather() it, otherwise log it.
    bool is_repeat(TimePoint now, std::string_view place, std::string_view what);
    /// Keeps the repeat for which is_repeat() has just returned true.
    void gather(std::string_view place, LogLine line, WallTime time);

    struct Gathered {
        LogLine line;  ///< the last one
        std::uint64_t repeated = 0;
        WallTime first{};
        WallTime last{};
    };
    /// Returns the merged lines to log first, because another event has followed.
    std::vector<Gathered> take_ended();
    /// Returns the lines that have merged repeats for kInterval.
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

/// Throttles repeats: an event of one subject passes a few times, then once per interval with the
/// number left out. As clients may choose subjects (addresses, topics), each client has a budget
/// for an event besides, and as they may choose their own addresses, too, all clients together have
/// one. Events without a client (lines, reloads) have a wide one of their own. Lines beyond a
/// budget are left out and counted. Bounded. Pure.
class LogThrottle {
  public:
    /// `burst` lines at once, then one per interval.
    struct Pace {
        int burst;
        Duration interval;
    };
    static constexpr Pace kIncidents{3, 10min};  ///< nine lines an hour for an endless repeat
    static constexpr Pace kActions{30, 1min};    ///< actions of users, and of programs without end
    static constexpr Pace kByClient{60, 1s};     ///< an event of one client, for all subjects
    /// An event of all clients together: 120 lines a minute are 20 MB a day. Twice as much as one
    /// client may use, so that it alone hides no other's.
    static constexpr Pace kByClients{120, 500ms};
    /// An event without a client. The configuration bounds its subjects: hundreds of stations may
    /// go offline at once, and each is to be seen.
    static constexpr Pace kByEvent{600, 100ms};
    static constexpr Duration kLeftOutPause = 1min;
    static constexpr std::size_t kMostSubjects = 1024;
    static constexpr std::size_t kMostClients = 256;
    /// Clients whose counts are reported one by one, those with the highest; the others' belong to
    /// their event's count, or the reports themselves would fill the log.
    static constexpr std::size_t kMostTold = 16;

    /// std::nullopt: this line is left out. Otherwise the number left out since the last one
    /// passed. `client` has no port; empty: the event has no client.
    std::optional<std::uint64_t> pass(TimePoint now, std::string_view event,
                                      std::string_view subject, const Pace& pace = kIncidents,
                                      std::string_view client = {});

    /// The last line left out, and how many before it.
    struct Held {
        LogLevel level = LogLevel::info;
        LogLine line;
        std::uint64_t left_out = 0;
    };
    /// Keeps the line that pass() has just left out: it is logged later if nothing follows. What a
    /// budget has left out is not kept.
    void hold(std::string_view event, std::string_view subject, LogLevel level, LogLine line);
    /// Returns the kept lines whose interval is over; each represents all before it. Those of
    /// clients need room in the budget of all clients, or are only counted.
    std::vector<Held> take_kept(TimePoint now);

    /// Number of lines beyond a budget; `client` is empty if it is not one client's.
    struct LeftOut {
        std::string event;
        std::string client;
        std::uint64_t count = 0;
        std::size_t clients = 0;  ///< whose lines they were, up to kMostClients; 0: nobody's
    };
    /// Returns the counts that have waited for kLeftOutPause, each once; TimePoint::max(): all.
    std::vector<LeftOut> take_left_out(TimePoint now);

  private:
    struct Seen {
        TimePoint last;  ///< when a line last passed
        Duration interval{};
        int credit = 0;
        std::uint64_t left_out = 0;
        LogLevel level = LogLevel::info;
        std::optional<LogLine> held{};  ///< the last line left out
        std::string client{};
    };
    struct Budget {
        std::string event;
        std::string client;
        TimePoint filled;
        int credit = 0;
        std::uint64_t left_out = 0;
        TimePoint since;  ///< first line left out and not yet reported
        /// Those whose lines were left out, if it is the budget of all clients.
        std::set<std::string, std::less<>> clients{};

        bool take();
        void leave_out(TimePoint at, std::uint64_t lines, std::string_view of = {});
        bool is_due(TimePoint now) const;
    };
    using Budgets = std::map<std::string, Budget, std::less<>>;

    Seen& new_subject(TimePoint now, std::string key, const Pace& pace, std::string_view client);
    void make_room(TimePoint now);
    bool is_within_budget(TimePoint now, std::string_view event, std::string_view client);
    bool may_be_logged(TimePoint now, const std::string& key, const Seen& seen);
    static Budget& budget(Budgets& budgets, TimePoint now, std::string_view event,
                          std::string_view client, const Pace& pace);
    Budget& all_clients(TimePoint now, std::string_view event);
    void make_room_for_client(TimePoint now);
    void gather_low_counts(TimePoint now);

    std::map<std::string, Seen, std::less<>> seen_;
    Budgets client_budgets_;
    Budgets all_clients_budgets_;  ///< of events with a client
    Budgets event_budgets_;        ///< of events without
};

}  // namespace panelgate::rt
