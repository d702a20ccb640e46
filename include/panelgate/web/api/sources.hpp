#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/web/http/message.hpp"

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

/// Makes the text of /metrics for whoever asks. One thread.
class MetricsSource {
  public:
    /// Null: there is none, because too many are under way or the caller was cancelled.
    using Handler = std::function<void(SharedText)>;

    virtual ~MetricsSource() = default;
    /// The handler is called once, with figures that are not older than this call; never from
    /// inside it. `gzip`: the text in that content coding. A caller asks for one at a time.
    virtual void scrape(std::uint64_t caller, bool gzip, Handler handler) = 0;
    /// The caller does not wait any more: it is handed null.
    virtual void cancel(std::uint64_t caller) = 0;
};

/// What came of a reload, for people and programs.
struct ReloadVerdict {
    /// Where a file is wrong. Line and column from 1; 0: the file as a whole.
    struct Fault {
        std::string file;
        int line = 0;
        int column = 0;
        std::string text;
    };
    ReloadOutcome outcome = ReloadOutcome::unchanged;
    WallTime at{};
    bool rollback = false;             ///< it was to what ran before
    std::string cause;                 ///< who wanted it: "SIGHUP", "http 10.0.0.9"
    std::vector<std::string> changes;  ///< a line each: "lines/floor1/stations/press: added"
    std::vector<std::string> later;    ///< what only a restart changes
    std::vector<std::string> warnings;
    std::vector<Fault> faults;  ///< of outcome invalid
    std::string why;            ///< of outcomes failed and refused
    /// What protects less after a way back: "station press: access read_only -> read_write".
    std::vector<std::string> weaker;
};

struct ReloadWish {
    bool rollback = false;  ///< what ran before, in place of the file
    bool weaker = false;    ///< ... also where that protects less than what runs
    friend bool operator==(const ReloadWish&, const ReloadWish&) = default;
};

/// Reads the configuration again and serves it. One thread.
class ReloadSource {
  public:
    using Handler = std::function<void(std::shared_ptr<const ReloadVerdict>)>;

    virtual ~ReloadSource() = default;
    /// Why there is nothing to be read, or to go back to; empty: there is.
    virtual std::string barred(bool rollback) const = 0;
    /// Not while barred(). The handler is called once, from the loop; who comes while one is under
    /// way gets the next.
    virtual void reload(ReloadWish wish, std::string cause, Handler handler) = 0;
    /// Of the last one; null: there was none.
    virtual std::shared_ptr<const ReloadVerdict> last() const = 0;
};

}  // namespace panelgate::web
