#pragma once

#include "panelgate/base/time.hpp"

/// Times of the arbiter that nobody configures, each with the threat (T1 to T14, src/rules.md) that
/// the time serves. What a panel or a line needs is learned: these are margins and limits.
namespace panelgate::arbiter::timing {

/// T1: a silence is over this much behind `response_timeout`, at least: a neighbour built on
/// libmodbus waits just as long for the reply, and then listens again (libmodbus#83 #799).
inline constexpr Duration kListensAgain = 4ms;
/// T1: an outage of all stations is young: their probes may use half of the line.
inline constexpr Duration kYoungOutage = 30s;
/// T1: stations with an answer within this time use the line.
inline constexpr Duration kOthersActive = 5s;
/// T1: an unlisted station that was never heard is forgotten when nobody has asked for so long.
inline constexpr Duration kForgetUnheard = 60s;
/// T1: a probe waits no longer than this for a line that is free.
inline constexpr Duration kProbeWaits = 20ms;
/// T1: of two frames that were lost, the first tells for so long that frames get lost on the line.
inline constexpr Duration kLosesFrames = 10s;
/// T4: pauses inside the replies of a station are forgotten when there was none for so long.
inline constexpr Duration kForgetHole = 10min;
/// T6: collisions are reported no more often.
inline constexpr Duration kReportsCollision = 10s;
/// T7: the end of a request is reported this much later than computed, at most.
inline constexpr Duration kLatestEnd = 1s;
/// T8: the first pause before a connection is made anew for silence once more; the pause doubles.
inline constexpr Duration kSilentReopen = 1s;
/// T8: the pause before a connection is made anew for silence grows up to this.
inline constexpr Duration kLongestReopen = 60s;
/// T9: what the panel of another master needs where none of ours has shown a need, and the bounds.
inline constexpr Duration kForeignThink = 10ms;
inline constexpr Duration kShortestForeign = 20ms;  ///< T9
inline constexpr Duration kLongestForeign = 100ms;  ///< T9
/// T9: a reply to another master's request comes within this time: that master asks again then.
inline constexpr Duration kForeignReply = 500ms;
/// T12: what follows a reply by more than this, and the time of a usual frame, is no copy of the
/// reply, and no glitch of the panel's transceiver.
inline constexpr Duration kLongestTrail = 60ms;
/// T12: a station whose replies have come twice rests behind its replies for so long afterwards.
inline constexpr Duration kForgetCopies = 2min;
/// T13: a frame of the last reply's form this soon behind that reply is a second panel's.
inline constexpr Duration kSecondPanel = 500ms;
/// P5: a look at a reply is put off no longer than this behind the last byte, or than the reply has
/// taken so far: a reply that is cut is noticed.
inline constexpr Duration kLongestLook = 30ms;
/// P5: late reading and late notification of bytes make the line no slower.
inline constexpr Duration kReadingSlack = 1ms;

}  // namespace panelgate::arbiter::timing
