#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/store/blocks.hpp"

namespace panelgate::store {

/// What an entry of the journal tells.
enum class Kind : std::uint8_t {
    start,
    stop,
    reload,
    line_up,
    line_down,
    station_online,
    station_offline,
    finding,
    finding_gone,
    write,
    refused,
    login_failed,
    discovery,
    alarm_raised,
    alarm_cleared,
    alarm_acknowledged,
    standby
};

/// "line_up"
std::string_view label(Kind kind);
std::optional<Kind> kind_of(std::string_view label);
/// "start, stop, reload ... and standby"
std::string known_kinds();

/// Something that happened. A text that does not apply is empty.
struct Entry {
    std::int64_t id = 0;  ///< given by the database, rising
    WallTime time{};
    Kind kind = Kind::start;
    std::string severity = "info";  ///< "info", "warning", "error", or an alarm's
    std::string line{};
    std::string station{};
    std::string point{};
    std::string who{};
    std::string text{};
    std::string data{};  ///< a JSON object, or ""

    friend bool operator==(const Entry&, const Entry&) = default;
};

/// Which entries are asked for; the newest come first.
struct JournalQuery {
    static constexpr std::size_t kLimit = 1000;  ///< of `limit`

    std::optional<WallTime> since{};  ///< the first time that counts
    std::optional<WallTime> until{};  ///< the first time that does not count any more
    std::vector<Kind> kinds{};        ///< none: all
    std::string station{};            ///< "": all
    std::size_t limit = 100;
    std::int64_t after = 0;  ///< only entries older than the one with this id; 0: all
    /// What the client may see; empty: everything. Called from the store's thread.
    std::function<bool(const Entry&)> may_see{};
};

struct JournalPage {
    std::vector<Entry> entries{};
    std::int64_t next = 0;  ///< `after` of the page that follows; 0: there is none
};

/// A step of a point's history. A step without a value is left out.
struct HistorySample {
    WallTime time{};  ///< where the step begins
    Summary values{};
};

struct HistoryQuery {
    static constexpr std::size_t kSamples = 20'000;  ///< of an answer

    std::string point{};  ///< "STATION/POINT"
    WallTime from{};
    WallTime to{};
    std::chrono::seconds step{10};  ///< a multiple of 10 s
};

}  // namespace panelgate::store
