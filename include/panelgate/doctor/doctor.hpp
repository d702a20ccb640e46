#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/doctor/finding.hpp"
#include "panelgate/doctor/settings.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::doctor {

/// What the configuration says, as far as advice depends on it.
struct LineFacts {
    SerialFormat serial;
    EchoMode echo = EchoMode::automatic;
    /// RTU over TCP: the wire is behind a server, which nobody here can see or set.
    bool over_tcp = false;
    Duration deadline = 2s;  ///< of a request: no reply later than this is ever waited for
    Duration response_timeout = 500ms;  ///< of stations without an entry below
    std::map<std::uint8_t, Duration> response_timeouts;
    std::map<std::uint8_t, std::string> names;  ///< of the stations that are listed
    std::set<std::uint8_t> crc_high_first;      ///< stations that are set so
};

/// The counts of one line: at an instant, or (as a difference of two) of a window.
struct Sample {
    /// Entry 0: all stations that the configuration does not list.
    std::map<std::uint8_t, arbiter::Symptoms> stations;
    std::optional<line::UartErrors> uart;
    std::uint64_t broadcasts = 0;  ///< sent: a panel should not answer these

    /// Of all stations together; mute_in_a_row and worst_lateness are the largest of them.
    arbiter::Symptoms total() const;
    std::uint64_t attempts() const;
};

/// What was counted between two instants of one line. What does not only grow (mute_in_a_row,
/// worst_lateness) is that of `later`.
Sample difference(const Sample& later, const Sample& earlier);

/// What the counts of a window tell, the likeliest cause first: in the order of Cause, and by
/// station. A healthy line, or one that was not used, gives nothing. A finding that is `standing`
/// stays by about half of the evidence that a new one needs. Pure.
std::vector<Finding> diagnose(const LineFacts& facts, const Sample& window,
                              const std::vector<Finding>& standing = {});

/// Watches the counts of one line over a moving window and tells when a finding appears and when it
/// goes. Pure: the owner says what time it is and what was counted. Bounded.
class Doctor {
  public:
    struct Change {
        std::vector<Finding> appeared;
        std::vector<Finding> gone;
    };

    Doctor(Settings settings, LineFacts facts);

    /// They are others now; what was found stands until the next look.
    void apply(LineFacts facts) { facts_ = std::move(facts); }
    /// The line was opened: what was counted before tells nothing about it, unless nothing but
    /// damage has come since the window began. Findings stay until there is something to judge by.
    void begin(TimePoint now, Sample counted);
    /// A step has passed since the window moved last.
    bool due(TimePoint now) const { return !marks_.empty() && now >= marks_.back().at + step(); }
    /// The last look was long enough ago for another one between two steps.
    bool rested(TimePoint now) const { return !marks_.empty() && now >= looked_ + settings_.rest; }
    /// Judges the window that ends now. `counted` holds the counts since the start.
    Change look(TimePoint now, const Sample& counted);

    /// As of the last look, the likeliest first.
    const std::vector<Finding>& findings() const { return findings_; }

  private:
    struct Mark {
        TimePoint at;
        Sample counted;
    };

    Duration step() const { return settings_.step; }
    void move_window(TimePoint now, const Sample& counted);

    Settings settings_;
    LineFacts facts_;
    std::deque<Mark> marks_;  ///< the first one begins the window
    TimePoint looked_{};
    std::vector<Finding> findings_;
};

}  // namespace panelgate::doctor
