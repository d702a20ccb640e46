// Everything that can happen in a few small worlds, to a depth that is told.
//
// PANELGATE_EXPLORER_STATES  distinct states in all (default 1 000 000; a tenth with sanitizers)

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>

#include "explorer.hpp"
#include "worlds.hpp"

namespace panelgate::explorer {
namespace {

std::size_t number_from(const char* variable, std::size_t fallback) {
    const char* text = std::getenv(variable);
    return text == nullptr ? fallback : std::strtoull(text, nullptr, 10);
}

std::size_t wanted_states() {
    const bool slow = number_from("PANELGATE_SANITIZED", 0) != 0;
    const std::size_t all = number_from("PANELGATE_EXPLORER_STATES", 1'000'000);
    return slow ? all / 10 : all;
}

class SmallWorld : public testing::TestWithParam<Rules> {};

TEST_P(SmallWorld, KeepsEveryPromiseWhateverHappens) {
    const Rules& rules = GetParam();
    Explorer explorer(rules, Flaw::none);
    const auto found = explorer.run(wanted_states() / small_worlds().size() + 1);
    std::cout << "  " << rules.name << ": " << explorer.states() << " states, " << explorer.moves()
              << " moves, all scripts of " << explorer.depth() << " moves\n";
    ASSERT_FALSE(found) << found->violation << "\n" << explorer.tell(found->moves);
}

INSTANTIATE_TEST_SUITE_P(Every, SmallWorld, testing::ValuesIn(small_worlds()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace panelgate::explorer
