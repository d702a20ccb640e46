// Plants without a fault, in virtual time: panelgate sends no more frames than a plain gateway, and
// answers no fewer requests (docs/how/threats.md).
//
// PANELGATE_SOUND_PLANTS   plants in all (default 1000; a tenth with sanitizers)
// PANELGATE_SCENARIO_SEED  this plant alone, with its history

#include <gtest/gtest.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "sound_plain.hpp"
#include "sound_plant.hpp"
#include "support/environment.hpp"

namespace panelgate::sound {
namespace {

constexpr Duration kLength = 40s;

/// A plant in which panelgate is worse than a plain gateway.
struct Worse {
    std::uint64_t seed = 0;
    std::uint64_t lost = 0;  ///< requests of sound panels that a plain gateway's share would answer
    std::uint64_t extra = 0;  ///< frames beyond one frame for each request
};

struct Sums {
    Tally panelgate{};
    Tally plain{};
    std::vector<Worse> worse;
};

std::uint64_t more_than(std::uint64_t one, std::uint64_t other) {
    return one > other ? one - other : 0;
}

/// All kinds but dead panels.
Count sound_sum(const Tally& tally) {
    Count sum;
    for (const Kind kind : kKinds)
        if (kind != Kind::dead) sum.add(tally[static_cast<std::size_t>(kind)]);
    return sum;
}

void play_one(std::uint64_t seed, bool with_history, Sums& sums) {
    const Plant plant = draw(seed);
    scenario::Subject panelgate(plant.settings);
    PlainGateway other_gateway(plant.settings);
    const Outcome gateway = play(plant, panelgate, kLength, with_history);
    const Outcome plain = play(plant, other_gateway, kLength);
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
        sums.panelgate[i].add(gateway.tally[i]);
        sums.plain[i].add(plain.tally[i]);
    }
    const Count one = sound_sum(gateway.tally);
    const Count other = sound_sum(plain.tally);
    const Worse worse{seed, more_than(one.requests - one.answered, other.requests - other.answered),
                      more_than(one.frames, one.alone)};
    if (worse.lost + worse.extra + one.wrong + one.offline > 0) sums.worse.push_back(worse);
    if (with_history) std::cout << gateway.history;
}

void print(const Sums& sums) {
    std::cout << "  kind        requests  answered     plain  frames/request  offline  wrong\n"
              << std::fixed;
    for (const Kind kind : kKinds) {
        const Count& one = sums.panelgate[static_cast<std::size_t>(kind)];
        const Count& plain = sums.plain[static_cast<std::size_t>(kind)];
        std::cout << "  " << std::left << std::setw(10) << label(kind) << std::right
                  << std::setw(10) << one.requests << std::setprecision(2) << std::setw(8)
                  << 100 * one.share() << " %" << std::setw(8) << 100 * plain.share() << " %"
                  << std::setprecision(4) << std::setw(16) << one.asked() << std::setw(9)
                  << one.offline << std::setw(7) << one.wrong << '\n';
    }
}

/// The seeds of the plants that show most of what is to be mended.
void print_worst(std::vector<Worse> worse) {
    std::ranges::sort(
        worse, [](const Worse& a, const Worse& b) { return a.lost + a.extra > b.lost + b.extra; });
    std::cout << "  " << worse.size() << " plants are worse than with a plain gateway";
    worse.resize(std::min<std::size_t>(worse.size(), 10));
    for (const Worse& one : worse)
        std::cout << (&one == worse.data() ? ": " : ", ") << "seed " << one.seed << " (" << one.lost
                  << " lost, " << one.extra << " frames more)";
    std::cout << '\n';
}

/// `more_frames`: for each request. `fewer_answers`: as a share of the requests.
void expect_sound(std::string_view what, const Count& one, const Count& plain, double more_frames,
                  double fewer_answers) {
    EXPECT_LE(one.asked(), 1 + more_frames) << what << ": frames for each request";
    EXPECT_GE(one.share(), plain.share() - fewer_answers) << what << ": share answered";
    EXPECT_EQ(one.offline, 0u) << what << ": taken offline";
    EXPECT_EQ(one.wrong, 0u) << what << ": wrong values";
}

TEST(Sound, APlantWithoutAFaultIsAskedOnceAndAnsweredAsByAPlainGateway) {
    const std::uint64_t only = test::number_from("PANELGATE_SCENARIO_SEED", 0);
    const std::uint64_t plants = test::amount_from("PANELGATE_SOUND_PLANTS", 1000);
    Sums sums;
    if (only != 0) {
        play_one(only, true, sums);
    } else {
        for (std::uint64_t seed = 1; seed <= plants; ++seed) play_one(seed, false, sums);
    }
    print(sums);
    print_worst(sums.worse);
    const Count all = sound_sum(sums.panelgate);
    const Count plain = sound_sum(sums.plain);
    EXPECT_GT(all.requests, 0u);
    // The plants are sound: a plain gateway has no trouble with them.
    EXPECT_GE(plain.share(), 0.999);
    expect_sound("plain gateway", plain, plain, 0, 0);
    expect_sound("all kinds", all, plain, 0.01, 0.002);
    for (const Kind kind : kKinds) {
        const auto at = static_cast<std::size_t>(kind);
        // The panels of one kind have fewer requests: chance moves their figures further.
        if (kind != Kind::dead)
            expect_sound(label(kind), sums.panelgate[at], sums.plain[at], 0.02, 0.005);
    }
}

/// Changes each hundredth answer, and sends each hundredth frame twice.
class BrokenGateway : public scenario::Subject {
  public:
    using Subject::Subject;
    std::optional<arbiter::Action> poll_action(TimePoint now) override {
        if (again_) return std::exchange(again_, std::nullopt);
        std::optional<arbiter::Action> action = Subject::poll_action(now);
        if (!action) return action;
        if (auto* finish = std::get_if<arbiter::Finish>(&*action); finish && finish->pdu)
            if (++finished_ % 100 == 0) finish->pdu->back() ^= 1;
        if (std::holds_alternative<arbiter::Transmit>(*action) && ++sent_ % 100 == 0)
            again_ = action;
        return action;
    }

  private:
    std::optional<arbiter::Action> again_;
    unsigned finished_ = 0;
    unsigned sent_ = 0;
};

TEST(Sound, AGatewayThatChangesAnswersAndSendsFramesTwiceIsFound) {
    const Plant plant = draw(1);
    BrokenGateway broken(plant.settings);
    const Count count = sound_sum(play(plant, broken, kLength).tally);
    EXPECT_GT(count.wrong, 0u);
    EXPECT_GT(count.asked(), 1.009);
}

}  // namespace
}  // namespace panelgate::sound
