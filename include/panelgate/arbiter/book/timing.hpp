#pragma once

#include "panelgate/base/time.hpp"

/// All times of the arbiter that nobody configures, each with its reason. What a panel, an adapter
/// or a line needs is learned where it can be: these are the margins and limits of that.
namespace panelgate::arbiter::timing {

// How long something is waited for.

/// Added to what a station has needed: an adapter's receive buffer, half a USB latency timer.
inline constexpr Duration kReceiveMargin = 8ms;
/// No wait for a station that is believed to be there is shorter: a USB latency timer (16 ms) and a
/// busy machine.
inline constexpr Duration kShortestWait = 20ms;
/// Within it a candidate's successor comes, beyond what the station has needed.
inline constexpr Duration kCandidateMargin = 10ms;
/// The end of a request is reported later than computed by this at most; more is another fault.
inline constexpr Duration kLatestEnd = 1s;
/// A look at a reply is not put off for longer than this behind the last byte, or than it has taken
/// so far: a cut one is noticed.
inline constexpr Duration kLongestLook = 30ms;
/// Late reading and late notification make the line no slower.
inline constexpr Duration kReadingSlack = 1ms;

// Until when a frame may be what it looks like.

/// A later frame is no duplicate of a reply, and no answer to another master's request: that master
/// would have asked again.
inline constexpr Duration kLatestRepetition = 500ms;
/// A later answer to the same request is held for another frame.
inline constexpr Duration kLatestSurplus = 100ms;
/// For so long the answer to another request may come again: an adapter keeps its last frame.
inline constexpr Duration kLatestCopy = 60s;
/// Some panels repeat a damaged reply within this.
inline constexpr Duration kRepeatsDamaged = 150ms;
/// A later frame is no answer to a broadcast; the latest that was seen came after a second.
inline constexpr Duration kLatestBroadcastAnswer = 5s;
/// Added to the delay of a station's answers to broadcasts.
inline constexpr Duration kBroadcastMargin = 100ms;
/// Later bytes behind a reply are no part of its trail.
inline constexpr Duration kLongestTrail = 60ms;
/// What another master's panel needs where none of ours has shown it, and the limits of that.
inline constexpr Duration kForeignThink = 10ms;
inline constexpr Duration kShortestForeign = 20ms;
inline constexpr Duration kLongestForeign = 100ms;

// Until when something that was learned is held.

/// Duplicates: they come and go with a cable or a second panel.
inline constexpr Duration kForgetDuplicates = 2min;
/// Habits of a panel's firmware: answers out of order, pauses inside replies.
inline constexpr Duration kForgetHabit = 10min;
/// Stations that nobody listed and nobody heard.
inline constexpr Duration kForgetUnheard = 60s;

// Turns.

/// A probe waits for a free line no longer than this.
inline constexpr Duration kProbeWaits = 20ms;
/// Others go before a retry for this long at least ...
inline constexpr Duration kOthersFirst = 20ms;
/// ... and one of each waiting station where the retry may take longer than this. What usually
/// takes longer lets one go between two of the same station.
inline constexpr Duration kDearRetry = 200ms;
/// An outage of all stations is young: probes may use half of the line.
inline constexpr Duration kYoungOutage = 30s;
/// After a failure the others wait impatiently for no longer than this.
inline constexpr Duration kUrgent = 5s;
/// Others that have answered within this use the line.
inline constexpr Duration kOthersActive = 5s;
/// Collisions are reported no more often.
inline constexpr Duration kReportsCollision = 10s;

}  // namespace panelgate::arbiter::timing
