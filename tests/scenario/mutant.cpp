#include "mutant.hpp"

#include "checker.hpp"
#include "play.hpp"
#include "world.hpp"

namespace panelgate::scenario {

std::string not_caught(const Mutant& mutant) {
    constexpr std::uint64_t kSeeds = 400;
    std::string others;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        Plan plan = draw(mutant.kind, seed, mutant.mode);
        mutant.shape(plan);
        const auto subject = mutant.make(plan.settings);
        Checker checker(plan);
        World world(plan, *subject, checker);
        world.run();
        // A seed on which the arbiter as it is breaks the same promise shows nothing.
        if (checker.violation().starts_with(mutant.caught_as) &&
            !play(plan).violation.starts_with(mutant.caught_as))
            return {};
        if (checker.failed()) others += "\n  " + checker.violation();
    }
    return "not caught in " + std::to_string(kSeeds) + " seeds as: " + mutant.caught_as + others;
}

}  // namespace panelgate::scenario
