#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "plan.hpp"

namespace panelgate::scenario {

/// What one run came to.
struct Outcome {
    std::string violation;
    std::string history;
    std::uint64_t wrong_values = 0;  ///< in the world of a limit: see Checker::wrong_values()
    std::string wrong_value;         ///< the first of them
    std::uint64_t frames = 0;
    std::uint64_t good = 0;
    std::uint64_t collisions = 0;
    std::uint64_t lucky = 0;  ///< answers that nobody said, with a CRC that was right by chance
    /// In place of an answer, of a panel that was not known to say its replies twice.
    std::uint64_t first_copies = 0;
    std::uint64_t excused = 0;  ///< those of them that no gateway can know
    double seconds = 0;
    double good_share = 0;        ///< of the time, for sound panels
    std::vector<Duration> waits;  ///< for answers of all panels but the odd one
    /// The longest that each station was not asked.
    std::map<std::uint8_t, Duration> longest_unasked;
    /// The longest silence of the line while a request waited that could have gone.
    Duration longest_idle{};
};
Outcome play(const Plan& plan, bool with_history = false);
/// One run with the oddity, and one without; what was broken, or nothing. P9: of one odd panel the
/// others do not wait much longer.
std::string compare(Oddity oddity, std::uint64_t seed, Outcome& with, bool history = false);

/// Of ten, the ninth.
Duration p90(std::vector<Duration> waits);

}  // namespace panelgate::scenario
