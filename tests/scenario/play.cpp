#include "play.hpp"

#include <algorithm>

#include "checker.hpp"
#include "subject.hpp"
#include "world.hpp"

namespace panelgate::scenario {

Outcome play(const Plan& plan, bool with_history) {
    Subject subject(plan.settings);
    Checker checker(plan);
    World world(plan, subject, checker);
    if (with_history) world.keep_history();
    const TimePoint start = world.now();
    world.run();
    Outcome outcome;
    outcome.violation = checker.violation();
    outcome.history = world.history();
    outcome.frames = checker.frames();
    outcome.good = checker.good_answers();
    outcome.collisions = checker.collisions();
    outcome.lucky = checker.lucky();
    outcome.excused = checker.excused();
    outcome.first_copies = checker.first_copies();
    outcome.seconds = to_seconds(world.now() - start);
    outcome.good_share = checker.good_share(world.now());
    outcome.waits = checker.waits();
    outcome.longest_unasked = checker.longest_unasked();
    outcome.longest_idle = checker.longest_idle();
    return outcome;
}

Duration p90(std::vector<Duration> waits) {
    if (waits.empty()) return {};
    const auto nth = waits.begin() + static_cast<std::ptrdiff_t>(waits.size() * 9 / 10);
    std::nth_element(waits.begin(), nth, waits.end());
    return *nth;
}

}  // namespace panelgate::scenario
