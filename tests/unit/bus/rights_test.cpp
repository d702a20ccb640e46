// What a station may be asked, and what goes out instead of what its panel lacks.
#include "panelgate/bus/rights.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "bus_case.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::bus::rights_test {
namespace {

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
std::optional<Refusal> judge(std::uint8_t station, const Bytes& pdu,
                             const Rights& rights = plant()) {
    return rights.judge(station, test::request_of(pdu));
}

TEST(Rights, AllowWhatNothingForbids) {
    EXPECT_EQ(judge(31, kWrite), std::nullopt);
    EXPECT_EQ(judge(99, kWrite), std::nullopt) << "nobody has listed it";
    EXPECT_EQ(judge(5, kWrite, Rights()), std::nullopt);
    EXPECT_EQ(judge(0, kWrite, Rights()), std::nullopt);
}

TEST(Rights, OnlyPureReadsReachAStationThatMayOnlyBeReadAndNoBroadcastPassesOverIt) {
    EXPECT_EQ(judge(5, kRead), std::nullopt);
    const Refusal refusal{Rule::read_only, "meter", modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(judge(5, kWrite), refusal);
    EXPECT_EQ(judge(5, "17 0000 0001 0000 0001 02 0001"_hex), refusal) << "it writes too";
    EXPECT_EQ(judge(5, "41"_hex), refusal) << "nobody knows what it does";
    const Refusal over{Rule::broadcast_over_read_only, "meter",
                       modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(judge(0, kWrite), over);
}

TEST(Rights, AGuardSaysWithWhatCodeItRefuses) {
    const Refusal refusal{Rule::function, "oven", modbus::ExceptionCode::illegal_function,
                          "too new"};
    EXPECT_EQ(judge(20, "10 0000 0001 02 0001"_hex), refusal);
    EXPECT_EQ(judge(20, kWrite), std::nullopt);
    EXPECT_EQ(judge(20, kRead), std::nullopt);
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
    EXPECT_EQ(judge(5, kWrite, rights).value().rule, Rule::read_only);
    EXPECT_EQ(judge(5, kRead, rights).value().rule, Rule::range);
}

TEST(Rights, ARuleHasTheCodeThatThePanelWouldAnswerAndAStableWord) {
    const struct {
        Rule rule;
        int code;
        const char* word;
    } kRules[] = {
        {Rule::function, 1, "function"},
        {Rule::range, 2, "range"},
        {Rule::write_protected, 2, "read-only"},
        {Rule::quantity, 3, "quantity"},
    };
    for (const auto& row : kRules) {
        Stations stations;
        stations[20].guard = [&row](const modbus::Request&) {
            return std::optional(Objection{row.rule});
        };
        const Refusal refusal = judge(20, kRead, Rights(std::move(stations))).value();
        EXPECT_EQ(static_cast<int>(refusal.code), row.code) << row.word;
        EXPECT_EQ(label(row.rule), row.word);
    }
    EXPECT_EQ(label(Rule::read_only), "access");
    EXPECT_EQ(label(Rule::broadcast_over_read_only), "access");
}

TEST(Rights, TellOfEveryWriteWhatTheyTellOfEach) {
    EXPECT_EQ(plant().judge_write(5), judge(5, kWrite));
    EXPECT_EQ(plant().judge_write(0), judge(0, kWrite));
    EXPECT_EQ(plant().judge_write(31), std::nullopt);
    EXPECT_EQ(plant().judge_write(20), std::nullopt) << "a guard has to see the write";
}

TEST(Rights, AStationIsCalledByItsNameAndAStrangerByItsId) {
    Stations stations;
    stations[17].name = "press";
    EXPECT_EQ(name_of(stations, 17), "press");
    EXPECT_EQ(name_of(stations, 18), "18");
}

const Bytes kWord = "06 00 64 12 34"_hex;
const Bytes kWordSent = "10 00 64 00 01 02 12 34"_hex;
const Bytes kWordReply = "10 00 64 00 01"_hex;

/// Station 17 has no functions for single items or inputs; 18 is not translated.
class BusTranslatesTest : public BusCase {
  protected:
    BusTranslatesTest() {
        list({});
        settings.stations[17].translate = modbus::translated;
        settings.stations[18].name = "oven";
        start_bus();
    }
    /// Returns the answer to `pdu` when the panel replies with `reply`.
    Answer answer(std::uint8_t station, const Bytes& pdu, const Bytes& reply) {
        line->reply = reply;
        return ask(station, pdu);
    }
    StationReport press() const { return bus->report().stations.at(1); }
};

TEST_F(BusTranslatesTest, WhatThePanelLacksGoesOutAsWhatItHasAndTheClientGetsItsOwnBack) {
    const Answer written = answer(17, kWord, kWordReply);
    EXPECT_EQ(written.pdu.value(), kWord);
    EXPECT_TRUE(written.transmitted);
    EXPECT_EQ(line->written.back(), modbus::encode_adu(17, kWordSent));
    const TraceFrame sent = bus->trace(2).frames.front();
    EXPECT_EQ(sent.bytes, modbus::encode_adu(17, kWordSent));
    EXPECT_TRUE(sent.why.ends_with(", instead of function 6")) << sent.why;
    EXPECT_EQ(press().requests.at(6)[Outcome::ok], 1u);
    EXPECT_FALSE(press().requests.contains(16));
    EXPECT_EQ(press().translated.at({6, 16}), 1u);
    const Answer read = answer(17, "04 00 64 00 01"_hex, "03 02 00 0A"_hex);
    EXPECT_EQ(read.pdu.value(), "04 02 00 0A"_hex);
}

TEST_F(BusTranslatesTest, ThePanelsExceptionIsThatOfTheFunctionAsked) {
    EXPECT_EQ(answer(17, kWord, "90 03"_hex).pdu.value(), "86 03"_hex);
}

TEST_F(BusTranslatesTest, P1AnEchoOfTheFunctionAskedIsNoAnswerToTheOneSent) {
    EXPECT_FALSE(answer(17, kWord, kWord).pdu.has_value());
}

TEST_F(BusTranslatesTest, P2SilenceLeavesTheOutcomeUnknownAndTheWriteIsSentOnce) {
    EXPECT_EQ(end_of(answer(17, kWord, {})), "timeout, sent");
    EXPECT_EQ(line->written.size(), 1u);
}

TEST_F(BusTranslatesTest, OthersAndBroadcastsGoOutAsTheyCame) {
    for (const std::uint8_t station : Bytes{18, 0}) {
        EXPECT_EQ(answer(station, kWord, kWord).pdu.value(), kWord);
        EXPECT_EQ(line->written.back(), modbus::encode_adu(station, kWord));
    }
}

TEST_F(BusTranslatesTest, AGuardJudgesWhatWasAsked) {
    settings.stations[17].guard = [](const modbus::Request& request) {
        return request.function() == 6 ? std::optional(Objection{Rule::function, "no function 6"})
                                       : std::nullopt;
    };
    start_bus();
    EXPECT_EQ(answer(17, kWord, kWordReply).pdu.value(), "86 01"_hex);
    EXPECT_TRUE(line->written.empty());
    EXPECT_TRUE(press().translated.empty());
}

TEST_F(BusTranslatesTest, P6ReadsOfTheSameItemsByBothFunctionsShareOneTransaction) {
    line->reply = "03 02 00 0A"_hex;
    std::vector<Answer> answers;
    send(18, "03 00 01 00 01"_hex, answers);  // keeps the line busy
    send(17, "03 00 64 00 01"_hex, answers);
    send(17, "04 00 64 00 01"_hex, answers);
    ASSERT_TRUE(run_until([&] { return answers.size() == 3; }));
    EXPECT_EQ(line->written.size(), 2u);
    EXPECT_EQ(answers[1].pdu.value(), "03 02 00 0A"_hex);
    EXPECT_EQ(answers[2].pdu.value(), "04 02 00 0A"_hex);
}

}  // namespace
}  // namespace panelgate::bus::rights_test
