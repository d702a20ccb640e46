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

/// The configuration, as far as advice depends on it.
struct LineFacts {
    SerialFormat serial;
    EchoMode echo = EchoMode::automatic;
    /// RTU over TCP: the wire is behind a device server and cannot be inspected from here.
    bool over_tcp = false;
    Duration deadline = 2s;             ///< of a request: no reply is awaited longer than this
    Duration response_timeout = 500ms;  ///< of stations without an entry below
    std::map<std::uint8_t, Duration> response_timeouts;
    std::map<std::uint8_t, std::string> names;  ///< of the listed stations
    std::set<std::uint8_t> crc_high_first;      ///< stations configured so
};

/// Counters of one line: at one time, or (as a difference) of a window.
struct Sample {
    /// Entry 0: all stations that the configuration does not list.
    std::map<std::uint8_t, arbiter::Symptoms> stations;
    std::optional<line::UartErrors> uart;
    std::uint64_t broadcasts = 0;  ///< sent; no panel should answer them
    bool telnet = false;           ///< the connection began with telnet's negotiation

    /// Sum of all stations; mute_in_a_row and worst_lateness are the maximum.
    arbiter::Symptoms total() const;
    std::uint64_t attempts() const;
};

/// Returns what was counted between two times on one line. Values that are no counters
/// (mute_in_a_row, worst_lateness, telnet) are those of `later`. Counters that have begun anew, so
/// that one is smaller than before, count from zero.
Sample difference(const Sample& later, const Sample& earlier);

/// Returns the findings of a window, the likeliest cause first: in the order of Cause, and by
/// station. Empty for a healthy or unused line. A finding in `standing` remains with about half of
/// the evidence that a new one needs. Pure.
std::vector<Finding> diagnose(const LineFacts& facts, const Sample& window,
                              const std::vector<Finding>& standing = {});

/// Watches the counters of one line over a moving window and reports when a finding appears and
/// when it goes. Pure: the caller passes time and counters. Bounded.
class Doctor {
  public:
    struct Change {
        std::vector<Finding> appeared;
        std::vector<Finding> gone;
    };

    Doctor(Settings settings, LineFacts facts);

    /// Applies new facts, and forgets the counts of stations that they do not list. Findings stay
    /// until the next look.
    void apply(LineFacts facts);
    /// The line was opened: earlier counts say nothing about it, unless only damage has come since
    /// the window began. Findings stay until there is new evidence.
    void begin(TimePoint now, Sample counted);
    /// True if a step has passed since the window last moved.
    bool due(TimePoint now) const { return !marks_.empty() && now >= marks_.back().at + step(); }
    /// True if another look between two steps is allowed.
    bool rested(TimePoint now) const { return !marks_.empty() && now >= looked_ + settings_.rest; }
    /// Evaluates the window that ends now. `counted`: totals since the start.
    Change look(TimePoint now, const Sample& counted);

    /// The line is down: withdraws and returns what a panel's silence said of the panel (P10).
    std::vector<Finding> withdraw_silence();

    /// Findings of the last look, the likeliest first.
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
