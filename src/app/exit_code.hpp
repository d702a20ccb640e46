#pragma once

namespace panelgate::app {

/// Exit codes (README, Configuration), after sysexits(3).
enum ExitCode : int {
    kFine = 0,
    kCut = 1,       ///< told twice to end: what was in flight is not answered
    kNotReady = 1,  ///< health: /readyz is not 200
    kUsage = 64,
    kNoInput = 66,
    kUnavailable = 69,
    kInternal = 70,
    kBadConfig = 78,
};

}  // namespace panelgate::app
