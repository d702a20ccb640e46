// The arbiter's promises in virtual time, with faults that no lab would reach.
//
// PANELGATE_SCENARIO_FRAMES  transactions in all (default 1 000 000; a tenth with sanitizers)
// PANELGATE_SCENARIO_SEED    this seed alone, to replay a failure with --gtest_filter

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "checker.hpp"
#include "plan.hpp"
#include "subject.hpp"
#include "world.hpp"

namespace panelgate::scenario {
namespace {

std::uint64_t number_from(const char* variable, std::uint64_t fallback) {
    const char* text = std::getenv(variable);
    return text == nullptr ? fallback : std::strtoull(text, nullptr, 10);
}

std::uint64_t wanted_frames() {
    const bool slow = number_from("PANELGATE_SANITIZED", 0) != 0;
    const std::uint64_t all = number_from("PANELGATE_SCENARIO_FRAMES", 1'000'000);
    return slow ? all / 10 : all;
}

class Scenario : public testing::TestWithParam<Kind> {};

TEST_P(Scenario, KeepsItsPromises) {
    const Kind kind = GetParam();
    const std::uint64_t only = number_from("PANELGATE_SCENARIO_SEED", 0);
    const std::uint64_t wanted = wanted_frames() / std::size(kKinds);
    std::uint64_t frames = 0;
    std::uint64_t good = 0;
    double virtual_seconds = 0;
    std::uint64_t seed = only == 0 ? 1 : only;
    for (; frames < wanted; ++seed) {
        const Plan plan = draw(kind, seed);
        Subject subject(plan.settings);
        Checker checker(plan.settings);
        World world(plan, subject, checker);
        if (only != 0) world.keep_history();
        const TimePoint start = world.now();
        world.run();
        ASSERT_FALSE(checker.failed())
            << checker.violation() << "\n  replay: PANELGATE_SCENARIO_SEED=" << seed
            << " scenario --gtest_filter='*" << label(kind) << "'\n"
            << world.history();
        frames += checker.frames();
        good += checker.good_answers();
        virtual_seconds += to_seconds(world.now() - start);
        if (only != 0) break;
    }
    std::cout << "  " << label(kind) << ": " << frames << " transactions, " << good
              << " good answers, 0 violations, " << virtual_seconds / 3600 << " h of virtual time, "
              << (only == 0 ? seed - 1 : 1) << " seeds\n";
    EXPECT_GT(good, 0u);
}

INSTANTIATE_TEST_SUITE_P(Every, Scenario, testing::ValuesIn(kKinds),
                         [](const auto& info) { return std::string(label(info.param)); });

/// What no gateway can exclude: a reply that is later than the quarantine reaches and has the shape
/// of the one that is then awaited. How often, with panels of which many are that late?
TEST(Beyond, ALateReplyThatOutlastsTheAutomaticWindowIsRare) {
    std::uint64_t frames = 0;
    std::uint64_t wrong = 0;
    for (std::uint64_t seed = 1; frames < wanted_frames() / 10; ++seed) {
        Plan plan = draw(Kind::faults, seed);
        for (arbiter::StationSettings& station : plan.settings.stations)
            station.late_window.reset();
        for (PanelPlan& panel : plan.panels) {
            panel.late = 0.02;
            panel.late_limit = 3;
        }
        Subject subject(plan.settings);
        Checker checker(plan.settings);
        World world(plan, subject, checker);
        world.run();  // ends at the first wrong value
        frames += checker.frames();
        wrong += checker.failed() ? 1 : 0;
    }
    std::cout << "  2 % of the replies up to 3 timeouts late, automatic window: " << wrong
              << " wrong values in " << frames << " transactions\n";
    EXPECT_LT(wrong * 1000, frames);
}

}  // namespace
}  // namespace panelgate::scenario
