// What cannot be promised (docs/how/limits.md): the rate of wrong answers in the worlds of each
// limit. All other promises hold there, too.
//
// PANELGATE_SCENARIO_FRAMES  a fifth of them is played here
// PANELGATE_SCENARIO_FIRST   the seed to begin with (default 1)
// PANELGATE_SCENARIO_SEED    this seed alone, with its history

#include <gtest/gtest.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>

#include "plan.hpp"
#include "play.hpp"
#include "support/environment.hpp"

namespace panelgate::scenario {
namespace {

/// Wrong answers in 100,000 transactions, and runs in a hundred in which another promise than that
/// of right answers breaks, because requests were answered by what is no answer: measured and
/// rounded up, to what a sample of 14,000 transactions may reach. A bound may only fall: who raises
/// one has made the gateway worse.
struct Bound {
    Limit limit;
    double wrong;
    double broken;
};
constexpr Bound kBounds[] = {
    {Limit::late_beyond_window, 40, 0},
    {Limit::overtaking, 60, 7},
    {Limit::copies_first, 60, 7},
    {Limit::one_behind, 7000, 0},
    {Limit::early, 900, 0},
    {Limit::confirmations, 80, 25},
    {Limit::two_answers, 450, 40},
    {Limit::echo_kinds, 2500, 40},
    {Limit::misnumbered, 20, 7},
    {Limit::damaged_repeated, 20, 45},
};

struct Measured {
    std::uint64_t frames = 0;
    std::uint64_t wrong = 0;
    std::uint64_t runs = 0;
    std::uint64_t broken = 0;
    std::string fatal;  ///< P2 and P3 hold in each world
    void add(const Measured& more) {
        frames += more.frames;
        wrong += more.wrong;
        runs += more.runs;
        broken += more.broken;
        fatal += more.fatal;
    }
    double rate() const { return 1e5 * share(wrong, frames); }
    double broken_share() const { return 1e2 * share(broken, runs); }
    static double share(std::uint64_t part, std::uint64_t all) {
        return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
    }
};

void print(std::string_view name, const Measured& all) {
    std::cout << "  " << std::left << std::setw(20) << name << std::right << std::setw(12)
              << all.frames << std::setw(8) << all.wrong << std::setw(10) << std::fixed
              << std::setprecision(1) << all.rate() << std::setw(10) << all.broken_share() << '\n';
}

/// `play_one` gives an outcome, and what was broken besides.
Measured measure(std::string_view world, std::uint64_t frames, const auto& play_one) {
    Measured all;
    const std::uint64_t first = test::number_from("PANELGATE_SCENARIO_FIRST", 1);
    const std::uint64_t only = test::number_from("PANELGATE_SCENARIO_SEED", 0);
    for (std::uint64_t seed = only == 0 ? first : only; all.frames < frames; ++seed) {
        const auto [one, broken] = play_one(seed, only != 0);
        all.add({one.frames, one.wrong_values, 1, broken.empty() ? 0u : 1u, {}});
        if (broken.starts_with("P2") || broken.starts_with("P3"))
            all.fatal +=
                "\n  " + std::string(world) + ", seed " + std::to_string(seed) + ": " + broken;
        if (only == 0) continue;
        std::cout << one.history << "  " << one.wrong_value << "  " << broken << '\n';
        break;
    }
    print(world, all);
    return all;
}

class Limits : public testing::TestWithParam<Bound> {};

TEST_P(Limits, WrongAnswersAreNoMoreThanTheBound) {
    const Bound& bound = GetParam();
    constexpr std::uint64_t kEnough = 15'000;  // for a rate that means something
    const std::uint64_t frames =
        std::max(kEnough, test::amount_from("PANELGATE_SCENARIO_FRAMES", 1'000'000) / 5 /
                              (std::size(kBounds) + 4));
    std::cout
        << "  world               transactions   wrong   in 1e5   other promises, in 100 runs\n";
    Measured all;
    for (const Kind kind : kinds_of(bound.limit))
        all.add(measure(label(kind), frames, [&](std::uint64_t seed, bool history) {
            Outcome one = play(draw(kind, seed), history);
            return std::pair(one, one.violation);
        }));
    for (const Oddity oddity : oddities_of(bound.limit))
        all.add(measure(label(oddity), frames, [&](std::uint64_t seed, bool history) {
            Outcome one;
            std::string broken = compare(oddity, seed, one, history);
            return std::pair(one, broken);
        }));
    print(label(bound.limit), all);
    std::cout << "  at most                                   " << std::setw(10) << bound.wrong
              << std::setw(10) << bound.broken << '\n';
    EXPECT_GT(all.frames, 0u);
    EXPECT_LE(all.rate(), bound.wrong) << label(bound.limit);
    EXPECT_LE(all.broken_share(), bound.broken) << label(bound.limit);
    EXPECT_EQ(all.fatal, "");
}

INSTANTIATE_TEST_SUITE_P(Every, Limits, testing::ValuesIn(kBounds),
                         [](const auto& info) { return std::string(label(info.param.limit)); });

bool has_bound(Limit limit) {
    return std::ranges::find(kBounds, limit, &Bound::limit) != std::end(kBounds);
}

TEST(LimitTable, HasABoundForEachLimitThatAWorldReaches) {
    for (const Row<Kind>& row : kKindRows)
        EXPECT_EQ(row.limit != Limit::none, has_bound(row.limit)) << row.name;
    for (const Row<Oddity>& row : kOddityRows)
        EXPECT_EQ(row.limit != Limit::none, has_bound(row.limit)) << row.name;
}

}  // namespace
}  // namespace panelgate::scenario
