#include "play.hpp"

#include <algorithm>

#include "checker.hpp"
#include "subject.hpp"
#include "world.hpp"

namespace panelgate::scenario {

Outcome play(const Plan& plan, bool with_history) {
    arbiter::Settings settings = plan.settings;
    settings.explain = with_history;
    Subject subject(settings);
    Checker checker(plan);
    World world(plan, subject, checker);
    if (with_history) world.keep_history();
    const TimePoint start = world.now();
    world.run();
    Outcome outcome;
    outcome.violation = checker.violation();
    outcome.history = world.history();
    outcome.wrong_values = checker.wrong_values();
    outcome.wrong_value = checker.wrong_value();
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

std::string compare(Oddity oddity, std::uint64_t seed, Outcome& with, bool history) {
    const Plan plan = draw_odd(oddity, seed);
    with = play(plan, history);
    if (!with.violation.empty()) return with.violation;
    const Outcome without = play(without_oddity(plan));
    if (!without.violation.empty()) return "without it: " + without.violation;
    const Duration much = p90(with.waits);
    const Duration usual = p90(without.waits);
    // Who says a reply twice has the line until the second one, and as long again as that may be
    // late: nobody can be asked meanwhile without a collision, and at a high rate that is longer
    // than all the others take. A request that misses its turn waits for one such rest more.
    const PanelPlan& odd = plan.panels.back();
    // Behind one whose replies have been late the line rests for as long as they may be (P1).
    const Duration timeout = plan.settings.unlisted.response_timeout;
    const Duration late =
        odd.late > 0 ? std::chrono::duration_cast<Duration>(timeout * odd.late_limit) : Duration{};
    // One that answers broadcasts when the line is in use again costs a request its timeout.
    const bool collides = odd.broadcast_think > plan.settings.broadcast_turnaround;
    const Duration rest = late + (collides ? timeout : Duration{}) +
                          (odd.duplicate > 0 ? odd.duplicate_delay * 3 / 2 : Duration{});
    if (much < 3 * usual + rest) return {};
    return "P9: of one odd panel the others wait " + std::to_string(much / 1us) + " us, else " +
           std::to_string(usual / 1us) + " us";
}

Duration p90(std::vector<Duration> waits) {
    if (waits.empty()) return {};
    const auto nth = waits.begin() + static_cast<std::ptrdiff_t>(waits.size() * 9 / 10);
    std::nth_element(waits.begin(), nth, waits.end());
    return *nth;
}

}  // namespace panelgate::scenario
