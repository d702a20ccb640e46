// Each plain fault alone, on a line that is otherwise healthy: the right finding, or none.
#include <gmock/gmock.h>

#include "diagnose_case.hpp"

namespace panelgate::doctor::plain_faults_test {
namespace {

using arbiter::Symptoms;

struct Fault {
    const char* what;
    Stations stations;
    Causes serial;    ///< findings on a line of its own
    Causes over_tcp;  ///< ... and behind a device server
};

const Symptoms kFine = Mix().answered(400, 0).answered(200);

std::vector<Fault> plain_faults() {
    return {
        {"nothing", {{1, kFine}, {2, kFine}}, {}, {}},
        {"a panel is off",
         {{1, kFine}, {2, Mix().answered(50).silent(9)}},
         {"station-silent 2"},
         {"station-silent 2"}},
        {"a panel was off and is back",
         {{1, kFine}, {2, Mix().answered(20, 0).silent(9).answered(50)}},
         {},
         {}},
        {"a plug was out and is in",
         {{1, Mix().answered(90).silent(9).answered(9)},
          {2, Mix().answered(90).silent(9).answered(9)}},
         {},
         {}},
        {"a register is ignored", {{1, kFine}, {2, Mix().silent(40).answered(90, 0)}}, {}, {}},
        {"one panel's replies are damaged, 4 %",
         {{1, kFine}, {2, Mix().answered(192).damaged(8)}},
         {"damaged-replies 2"},
         {"damaged-replies 2"}},
        {"one panel has another baud",
         {{1, kFine}, {2, Mix().garbage(20)}},
         {"wrong-baud 2"},
         {"damaged-replies 2"}},
        {"one panel has another parity",
         {{1, kFine}, {2, Mix().zeroed(20)}},
         {"wrong-parity 2"},
         {"damaged-replies 2"}},
        {"all have another baud",
         {{1, Mix().garbage(20)}, {2, Mix().garbage(20)}},
         {"wrong-baud"},
         {"tcp-framing"}},
        {"all have another parity",
         {{1, Mix().zeroed(20)}, {2, Mix().zeroed(20)}},
         {"wrong-parity"},
         {"wrong-parity"}},
        {"a panel answers late",
         {{1, kFine}, {2, Mix().silent(20).late(20, 300ms)}},
         {"timeout-too-short 2"},
         {"timeout-too-short 2"}},
        {"strangers are looked for", {{0, Mix().silent(200)}, {1, kFine}, {2, kFine}}, {}, {}},
        {"1 % is lost",
         {{1, Mix().answered(297, 0).lost(2, 0).lost(1)}, {2, Mix().answered(297).lost(3)}},
         {},
         {}},
        {"10 % is lost",
         {{1, Mix().answered(270, 0).lost(25, 0).lost(5)}, {2, Mix().answered(270).lost(30)}},
         {},
         {}},
        {"1 % is damaged",
         {{1, Mix().answered(396).damaged(4)}, {2, Mix().answered(396).damaged(5)}},
         {"noise"},
         {"noise"}},
    };
}

TEST_F(Diagnose, EachPlainFaultAloneIsNamedRightlyOrNotAtAll) {
    for (const Fault& fault : plain_faults()) {
        facts.over_tcp = false;
        EXPECT_EQ(causes(fault.stations), fault.serial) << fault.what;
        facts.over_tcp = true;
        EXPECT_EQ(causes(fault.stations), fault.over_tcp) << fault.what << ", tcp";
    }
}

/// Texts and figures report the same numbers.
TEST_F(Diagnose, EachFigureStandsInTheWordsToo) {
    for (const bool over_tcp : {false, true}) {
        facts.over_tcp = over_tcp;
        for (const Fault& fault : plain_faults()) {
            for (const Finding& f : findings(fault.stations)) {
                EXPECT_FALSE(f.figures.empty()) << code(f.cause);
                for (const auto& [name, value] : f.figures) {
                    EXPECT_THAT(f.evidence + f.advice, ::testing::HasSubstr(std::to_string(value)))
                        << code(f.cause) << ' ' << name;
                }
            }
        }
    }
}

}  // namespace
}  // namespace panelgate::doctor::plain_faults_test
