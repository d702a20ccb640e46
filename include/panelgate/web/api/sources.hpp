#pragma once

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/alarms/alarms.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/last_minute.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// An unlisted station that a discovery has found.
struct DiscoveredStation {
    std::uint8_t id = 0;
    std::vector<std::string> profiles;  ///< candidates that match its answers, best first
    std::string evidence;               ///< human-readable
};

/// State and results of a discovery.
struct DiscoveryReport {
    enum class State : std::uint8_t { never, running, done, stopped };
    State state = State::never;
    unsigned share_percent = 0;  ///< maximum share of the line's time
    std::size_t asked = 0;       ///< addresses
    std::size_t refused = 0;     ///< addresses that the line refused to ask
    std::size_t of = 0;
    std::string asked_stations;               ///< those asked: "1-4,6-31"
    std::string silent_stations;              ///< of these, those that did not answer
    std::optional<Duration> remaining;        ///< estimated from the pace so far; nothing: unknown
    std::vector<DiscoveredStation> stations;  ///< so far
    std::string yaml;                         ///< to paste below `stations:`; "" without any
    Duration bus{};                           ///< line time used
    Duration took{};
    std::string why;  ///< of State::stopped
};
std::string_view label(DiscoveryReport::State state);

/// Discovers stations on running lines, by reads only. One thread.
class DiscoverySource {
  public:
    virtual ~DiscoverySource() = default;
    /// Starts a discovery on an existing line. `stations`: "5,17,20-31"; listed stations are
    /// skipped. Returns what is wrong with the list, if anything; then nothing has started.
    virtual std::optional<std::string> start(std::string_view line, std::string_view stations,
                                             unsigned share_percent) = 0;
    /// Stops the discovery and keeps what it has found. No effect if none is running.
    virtual void stop(std::string_view line) = 0;
    /// The report of the line's last discovery.
    virtual DiscoveryReport report(std::string_view line) const = 0;
};

/// What this box is beside another one that shares its lines.
struct StandbyView {
    struct Line {
        std::string name;
        std::string role;  ///< listening, claiming or active
        std::string why;
        Duration since{};  ///< so long ago
        bool deaf = false;
    };
    bool is_on = false;  ///< false: there is no other box
    std::vector<Line> lines{};
    std::string peer{};  ///< the other box's role; "": not known

    /// True if this box drives its lines: one of those that it shares, at least.
    bool is_active() const {
        return !is_on || lines.empty() ||
               std::ranges::any_of(lines, [](const Line& one) { return one.role == "active"; });
    }
};

/// An alarm as REST tells it.
struct AlarmView {
    alarms::Settings settings{};
    alarms::Status status{};
    std::string line{};  ///< of its station, or its own; "": none
};
class AlarmSource {
  public:
    enum class Acknowledged : std::uint8_t {
        done,
        unknown,  ///< there is no alarm of this name
        nothing   ///< somebody has acknowledged the alarm, or it is normal
    };
    virtual ~AlarmSource() = default;
    /// In the order of the configuration.
    virtual std::vector<AlarmView> list() const = 0;
    virtual Acknowledged acknowledge(const std::string& name, const std::string& who) = 0;
};

/// A finding of the gateway itself, or of the load of a line: what a user must know beside what the
/// line doctor finds.
struct Finding {
    std::string cause;  ///< "overload", "broker-away" ...: stable identifiers
    std::string line;   ///< of an overload; else empty
    std::string name;   ///< the line, the broker, the file, or the listener that it is about
    std::string text;   ///< what is wrong
    std::string advice;
    std::string evidence;  ///< the numbers behind it; may be empty
    std::map<std::string, std::uint64_t> figures{};
    std::vector<bus::HostUse> clients{};  ///< of an overload: who asked in the last minute
    WallTime since{};
};

/// A line and what was used of it.
struct LineUsage {
    std::string line;
    bus::MinuteUse minute;
};

/// The result of a reload.
struct ReloadVerdict {
    /// A fault in a file. Line and column count from 1; 0: the file as a whole.
    struct Fault {
        std::string file;
        int line = 0;
        int column = 0;
        std::string text;
    };
    ReloadOutcome outcome = ReloadOutcome::unchanged;
    WallTime at{};
    bool rollback = false;             ///< true: back to the previous configuration
    std::string cause;                 ///< what triggered it: "SIGHUP", "http 10.0.0.9"
    std::vector<std::string> changes;  ///< one line each: "lines/floor1/stations/press: added"
    std::vector<std::string> later;    ///< settings that only a restart changes
    std::vector<std::string> warnings;
    std::vector<Fault> faults;  ///< of outcome invalid
    std::string why;            ///< of outcomes failed and refused
    /// What a rollback would protect less: "station press: access read_only -> read_write".
    std::vector<std::string> weaker;
};

struct ReloadWish {
    bool rollback = false;  ///< return to the previous configuration, do not read the file
    bool weaker = false;    ///< ... even if it protects less than the running one
    friend bool operator==(const ReloadWish&, const ReloadWish&) = default;
};

/// Reloads the configuration. One thread.
class ReloadSource {
  public:
    using Handler = std::function<void(std::shared_ptr<const ReloadVerdict>)>;

    virtual ~ReloadSource() = default;
    /// Why a reload or rollback is not possible now; empty: it is.
    virtual std::string barred(bool rollback) const = 0;
    /// Starts a reload; not while barred(). The handler is called once, from the loop. Calls made
    /// while a reload is running are served by the next one.
    virtual void reload(ReloadWish wish, std::string cause, Handler handler) = 0;
    /// The result of the last reload; null: there was none.
    virtual std::shared_ptr<const ReloadVerdict> last() const = 0;
};

/// A text of the configuration that ran.
struct TextVersion {
    std::uint64_t version = 0;  ///< from 1
    WallTime time{};            ///< since when it ran
    std::string who;            ///< as ReloadVerdict::cause
    std::string sha256;         ///< 64 hex digits
};

/// What came of a text that was to be written.
struct TextVerdict {
    enum class State : std::uint8_t {
        written,      ///< and it runs
        stale,        ///< the file is another one than expected
        invalid,      ///< `problems` has its faults
        read_only,    ///< the file cannot be written
        not_written,  ///< the disk has not taken it
        not_applied,  ///< it could not be served, so the file was put back
    };
    State state = State::not_written;
    std::string sha256;                             ///< of the file as it is now, where it was read
    boost::json::array problems{};                  ///< as TextSource::judge() has them
    boost::json::array changes{};                   ///< from what ran, likewise
    std::string why;                                ///< why it is not written, or does not run
    std::shared_ptr<const ReloadVerdict> reload{};  ///< of State::written
};

/// The text of the configuration: a file, which stays the truth. One thread; but functions that it
/// returns take long, and run in any thread.
class TextSource {
  public:
    struct File {
        std::optional<std::string> text;  ///< nothing: it cannot be read
        std::string sha256;
        std::string why;  ///< why it cannot be read, or written; empty: both can be
    };
    struct Inserted {
        std::optional<std::string> text;
        int line = 0;     ///< where the item begins, from 1
        std::string why;  ///< why there is no text
    };
    using Handler = std::function<void(TextVerdict)>;
    virtual ~TextSource() = default;
    /// Why the file could not be written at the last reload; empty: it could.
    virtual std::string read_only() const = 0;
    virtual std::function<File()> reader() const = 0;
    /// {"valid", "problems", "changes", "interruptions", "plan"} of a text that might run next.
    virtual std::function<boost::json::object(const std::string& text)> judge() const = 0;
    /// The JSON Schema of the configuration.
    virtual std::function<boost::json::object()> schema() const = 0;
    /// Puts an item into this text, or into the file's (yaml::insert()).
    virtual std::function<Inserted(const std::optional<std::string>& text, const std::string& into,
                                   const boost::json::object& item)>
    inserter() const = 0;
    /// Writes a valid text and reloads, where `expected` (an If-Match) names the file's SHA-256.
    /// The handler is called once, from the loop.
    virtual void write(std::string text, std::string expected, std::string who,
                       Handler handler) = 0;
    /// The last texts that ran, the newest first.
    virtual std::vector<TextVersion> versions() const = 0;
    virtual std::optional<std::string> version(std::uint64_t version) const = 0;
};

}  // namespace panelgate::web
