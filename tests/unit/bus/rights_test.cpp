#include "panelgate/bus/rights.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::bus::rights_test {
namespace {

const Bytes kRead = "03 0000 0001"_hex;
const Bytes kWrite = "06 0000 0001"_hex;

/// press 31 may be written, meter 5 is read-only; oven 20 is guarded against functions above 6.
Rights plant() {
    Stations stations;
    stations[31].name = "press";
    stations[5] = {"meter", Access::read_only, {}};
    stations[20].name = "oven";
    stations[20].guard = [](const modbus::Request& request) {
        return request.function() > 6 ? std::optional(Objection{Rule::function, "too new"})
                                      : std::nullopt;
    };
    return Rights(std::move(stations));
}

TEST(Rights, AllowWhatNothingForbids) {
    EXPECT_EQ(plant().judge(31, test::request_of(kWrite)), std::nullopt);
    EXPECT_EQ(plant().judge(99, test::request_of(kWrite)), std::nullopt) << "nobody has listed it";
    EXPECT_EQ(Rights().judge(5, test::request_of(kWrite)), std::nullopt);
    EXPECT_EQ(Rights().judge(0, test::request_of(kWrite)), std::nullopt);
}

TEST(Rights, OnlyPureReadsReachAStationThatMayOnlyBeRead) {
    EXPECT_EQ(plant().judge(5, test::request_of(kRead)), std::nullopt);
    const Refusal refusal{Rule::read_only, "meter", modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(plant().judge(5, test::request_of(kWrite)), refusal);
    EXPECT_EQ(plant().judge(5, test::request_of("17 0000 0001 0000 0001 02 0001"_hex)), refusal)
        << "it writes too";
    EXPECT_EQ(plant().judge(5, test::request_of("41"_hex)), refusal) << "nobody knows what it does";
}

TEST(Rights, ABroadcastOverAStationThatMayOnlyBeReadIsRefused) {
    const Refusal refusal{Rule::broadcast_over_read_only, "meter",
                          modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(plant().judge(0, test::request_of(kWrite)), refusal);
}

TEST(Rights, AGuardSaysWithWhatCodeItRefuses) {
    const Refusal refusal{Rule::function, "oven", modbus::ExceptionCode::illegal_function,
                          "too new"};
    EXPECT_EQ(plant().judge(20, test::request_of("10 0000 0001 02 0001"_hex)), refusal);
    EXPECT_EQ(plant().judge(20, test::request_of(kWrite)), std::nullopt);
    EXPECT_EQ(plant().judge(20, test::request_of(kRead)), std::nullopt);
}

TEST(Rights, AGuardAnswersAsItsPanelWould) {
    const Refusal guarded{Rule::range, "oven", modbus::ExceptionCode::illegal_data_address};
    EXPECT_EQ(answer_to(guarded, 6).value(), (Bytes{0x86, 2}));
    EXPECT_EQ(answer_to({Rule::read_only, "meter"}, 6).error(), Fault::denied);
    EXPECT_EQ(answer_to({Rule::broadcast_over_read_only, "meter"}, 6).error(), Fault::denied);
}

TEST(Rights, AccessIsJudgedBeforeTheGuardIsAsked) {
    Stations stations;
    stations[5] = {"meter", Access::read_only,
                   [](const modbus::Request&) { return std::optional(Objection{Rule::range}); }};
    const Rights rights(std::move(stations));
    EXPECT_EQ(rights.judge(5, test::request_of(kWrite)).value().rule, Rule::read_only);
    EXPECT_EQ(rights.judge(5, test::request_of(kRead)).value().rule, Rule::range);
}

TEST(Rights, AGuardsRuleGivesTheCodeThatThePanelWouldAnswer) {
    for (const auto& [rule, code] :
         {std::pair(Rule::function, 1), std::pair(Rule::range, 2),
          std::pair(Rule::write_protected, 2), std::pair(Rule::quantity, 3)}) {
        Stations stations;
        stations[20].guard = [rule](const modbus::Request&) {
            return std::optional(Objection{rule});
        };
        const Refusal refusal =
            Rights(std::move(stations)).judge(20, test::request_of(kRead)).value();
        EXPECT_EQ(static_cast<int>(refusal.code), code) << label(rule);
    }
}

TEST(Rights, TellOfEveryWriteWhatTheyTellOfEach) {
    EXPECT_EQ(plant().judge_write(5), plant().judge(5, test::request_of(kWrite)));
    EXPECT_EQ(plant().judge_write(0), plant().judge(0, test::request_of(kWrite)));
    EXPECT_EQ(plant().judge_write(31), std::nullopt);
    EXPECT_EQ(plant().judge_write(20), std::nullopt) << "a guard has to see the write";
}

}  // namespace
}  // namespace panelgate::bus::rights_test
