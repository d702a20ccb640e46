// What cannot be promised (docs/how/limits.md): the rate of wrong answers in the worlds of each
// limit. All other promises hold there, too.
//
// PANELGATE_SCENARIO_FRAMES  a fifth of them is played here
// PANELGATE_SCENARIO_FIRST   the seed to begin with (default 1)

#include <gtest/gtest.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <string>

#include "plan.hpp"
#include "play.hpp"
#include "support/environment.hpp"

namespace panelgate::scenario {
namespace {

/// Wrong answers in 100,000 transactions, measured and rounded up. A bound may only fall: who
/// raises one has made the gateway worse.
struct Bound {
    Limit limit;
    double most;
};
constexpr Bound kBounds[] = {
    {Limit::late_beyond_window, 1000}, {Limit::overtaking, 1000}, {Limit::copies_first, 1000},
    {Limit::one_behind, 100000},       {Limit::early, 100000},    {Limit::confirmations, 1000},
    {Limit::two_answers, 1000},        {Limit::echo_kinds, 1000}, {Limit::misnumbered, 1000},
    {Limit::damaged_repeated, 1000},
};

struct Measured {
    std::uint64_t frames = 0;
    std::uint64_t wrong = 0;
    std::string broken;  ///< another promise than that of right answers
    void add(std::string_view world, std::uint64_t seed, const Outcome& one) {
        frames += one.frames;
        wrong += one.wrong_values;
        if (!one.violation.empty())
            broken += "\n  " + std::string(world) + ", seed " + std::to_string(seed) + ": " +
                      one.violation;
    }
    double rate() const {
        return frames == 0 ? 0 : 1e5 * static_cast<double>(wrong) / static_cast<double>(frames);
    }
};

Measured measure(std::string_view world, std::uint64_t frames, const auto& plan_of) {
    Measured all;
    const std::uint64_t first = test::number_from("PANELGATE_SCENARIO_FIRST", 1);
    for (std::uint64_t seed = first; all.frames < frames; ++seed)
        all.add(world, seed, play(plan_of(seed)));
    std::cout << "  " << std::left << std::setw(20) << world << std::right << std::setw(10)
              << all.frames << std::setw(8) << all.wrong << std::setw(10) << std::fixed
              << std::setprecision(1) << all.rate() << '\n';
    return all;
}

class Limits : public testing::TestWithParam<Bound> {};

TEST_P(Limits, WrongAnswersAreNoMoreThanTheBound) {
    const auto [limit, most] = GetParam();
    const std::uint64_t frames =
        test::amount_from("PANELGATE_SCENARIO_FRAMES", 1'000'000) / 5 / (std::size(kBounds) + 4);
    std::cout << "  world           transactions   wrong   in 100,000 (at most " << most << ")\n";
    Measured all;
    const auto add = [&](const Measured& one) {
        all.frames += one.frames;
        all.wrong += one.wrong;
        all.broken += one.broken;
    };
    for (const Kind kind : kinds_of(limit))
        add(measure(label(kind), frames, [&](std::uint64_t seed) { return draw(kind, seed); }));
    for (const Oddity oddity : oddities_of(limit))
        add(measure(label(oddity), frames,
                    [&](std::uint64_t seed) { return draw_odd(oddity, seed); }));
    EXPECT_GT(all.frames, 0u);
    EXPECT_LE(all.rate(), most) << label(limit);
    EXPECT_EQ(all.broken, "");
}

INSTANTIATE_TEST_SUITE_P(Every, Limits, testing::ValuesIn(kBounds),
                         [](const auto& info) { return std::string(label(info.param.limit)); });

TEST(LimitTable, HasABoundForEachLimitThatAWorldReaches) {
    for (const Row<Kind>& row : kKindRows)
        EXPECT_EQ(row.limit == Limit::none,
                  std::ranges::find(kBounds, row.limit, &Bound::limit) == std::end(kBounds));
    for (const Row<Oddity>& row : kOddityRows)
        EXPECT_EQ(row.limit == Limit::none,
                  std::ranges::find(kBounds, row.limit, &Bound::limit) == std::end(kBounds));
}

}  // namespace
}  // namespace panelgate::scenario
