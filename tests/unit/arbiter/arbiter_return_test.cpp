// Outstanding replies where the transport may delay them, across connections (P1, P4).
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "arbiter_fixture.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::arbiter_return_test {
namespace {

/// A device server that hangs still accepts connections: its kernel does.
class AfterAReset : public ArbiterTest {
  protected:
    /// A request was sent twice and not answered, then the line was reopened.
    AfterAReset() {
        settings.may_stall = true;
        settings.stations[0].late_window = 500ms;
        script.emplace(settings);
        const Ticket first = script->submit(17, read_at(1), 1);
        while (!script->answered(first)) script->run_for(1ms);
        open_anew(2s);
    }
    void open_anew(Duration wait) {
        script->line_down();
        script->line_up();
        script->run_for(wait);
    }
    void ask() {
        const std::size_t before = script->sent.size();
        second = script->submit(17, read_at(2), 1);
        if (script->sent.size() == before) script->next_sent();
        script->run_to_end_of_request();
    }
    bool read_at_2_was_sent() const {
        const Bytes adu = modbus::encode_adu(17, read_at(2));
        return std::ranges::any_of(script->sent, [&](const auto& one) { return one.adu == adu; });
    }
    std::optional<BusScript> script;
    Ticket second = 0;
};

TEST_F(AfterAReset, P1EarlierOutstandingRepliesAnswerNoRequest) {
    ask();
    ASSERT_FALSE(read_at_2_was_sent()) << "nothing tells yet that its reply would be its own";
    script->hear_reply(17, kReply);  // the server goes on: the first attempt's
    script->run_for(20ms);
    script->hear_reply(17, "03 06 02 2B 00 00 00 65"_hex);  // the second's
    script->run_for(20ms);
    EXPECT_FALSE(script->answered(second));
    script->hear_reply(17, "03 02 00 01"_hex);  // the reply to the proof
    script->run_for(20ms);
    ASSERT_TRUE(read_at_2_was_sent()) << "nothing is owed any more";
    script->hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script->answer(second).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AfterAReset, P1AfterAProofItRestsUntilOutstandingRepliesCouldHaveCome) {
    ask();
    script->hear_reply(17, "03 02 00 01"_hex);
    const TimePoint proved = script->now();
    script->run_for(600ms);
    EXPECT_FALSE(read_at_2_was_sent());
    ASSERT_TRUE(script->next_sent(500ms));
    EXPECT_TRUE(read_at_2_was_sent());
    EXPECT_GE(script->now() - proved, 900ms) << "the timeout, and as much for being late";
}

TEST_F(AfterAReset, P1AnExceptionMayAnswerAnOutstandingRequest) {
    ask();
    script->hear_reply(17, "83 02"_hex);
    script->run_for(900ms);
    EXPECT_FALSE(read_at_2_was_sent()) << "two are owed yet, of three";
    script->hear_reply(17, "83 02"_hex);  // the answer to the proof, of another length
    while (!read_at_2_was_sent()) ASSERT_TRUE(script->next_sent(2s));
    script->run_to_end_of_request();
    script->hear_reply(17, "83 02"_hex);
    EXPECT_FALSE(script->answered(second)) << "that may be of it";
    script->hear_reply(17, "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script->answer(second).pdu.value(), "03 06 00 01 00 02 00 03"_hex);
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AfterAReset, APanelThatIsSilentToAProofComesBackByClientRequests) {
    settings.offline.after = 2;  // it has been silent once
    script->apply(settings);
    ask();
    ASSERT_NE(script->sent.back().adu, modbus::encode_adu(17, read_at(1)));
    script->run_for(1s);
    ASSERT_EQ(script->resets, 1);
    EXPECT_FALSE(script->arbiter().health(17).offline()) << "that tells nothing of the panel";
    open_anew(2s);
    ask();
    EXPECT_EQ(script->sent.back().adu, modbus::encode_adu(17, read_at(1)));
}

TEST_F(AfterAReset, APanelThatAnswersAProofWronglyComesBackAsWell) {
    ask();
    const Bytes proof = script->sent.back().adu;
    script->hear_reply(17, "03 04 00 01 00 02"_hex);
    script->run_for(1s);
    ASSERT_EQ(script->resets, 1);
    EXPECT_FALSE(script->arbiter().health(17).offline());
    open_anew(2s);
    ask();
    EXPECT_NE(script->sent.back().adu, proof);
}

TEST_F(AfterAReset, P1AfterASecondAnswerItRestsUntilOutstandingRepliesCouldHaveCome) {
    ask();
    script->run_for(1s);
    open_anew(2s);
    ask();
    script->hear_reply(17, kReply);
    script->run_for(800ms);
    ASSERT_FALSE(read_at_2_was_sent());
    script->hear_reply(17, kReply);  // an earlier one: as many may follow as are outstanding
    script->run_for(900ms);
    ASSERT_FALSE(read_at_2_was_sent());
    ASSERT_TRUE(script->next_sent(2s));
    EXPECT_TRUE(read_at_2_was_sent());
    EXPECT_EQ(script->resets, 1) << "none for that";
}

TEST_F(AfterAReset, WhatCannotBeMistakenGoesItselfAndProvesTheTransport) {
    const Ticket write = script->submit(17, kWrite, 1);
    script->run_to_end_of_request();
    ASSERT_EQ(script->sent.back().adu, modbus::encode_adu(17, kWrite)) << "reads alone are owed";
    script->hear_reply(17, kReply);  // the server goes on
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(write).pdu.value(), kWrite);
    EXPECT_EQ(script->resets, 0);
}

/// Replies to reads and to a write are outstanding, from a connection before the open one.
class AWriteIsOutstanding : public AfterAReset {
  protected:
    AWriteIsOutstanding() {
        const Ticket write = script->submit(17, "06 00 05 00 01"_hex, 1);
        while (!script->answered(write)) script->run_for(10ms);
        open_anew(3s);
        second = script->submit(17, kWrite, 1);
        script->run_to_end_of_request();
    }
};

TEST_F(AWriteIsOutstanding, P4AWriteOfAnotherPlaceGoesAtOnce) {
    EXPECT_EQ(script->sent.back().adu, modbus::encode_adu(17, kWrite)) << "its reply names it";
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(second).pdu.value(), kWrite);
    EXPECT_EQ(script->resets, 0);
}

TEST_F(AWriteIsOutstanding, P1ARefusalOfItAnswersNoOther) {
    script->hear_reply(17, "86 02"_hex);
    EXPECT_FALSE(script->answered(second));
    script->hear_reply(17, kWrite);
    EXPECT_EQ(script->answer(second).pdu.value(), kWrite);
}

TEST_F(AfterAReset, P1TheAnswerOfAnotherStationProvesTheTransport) {
    const Ticket other = script->submit(18, kRead, 2);
    script->run_to_end_of_request();
    script->hear_reply(18, kReply);
    ASSERT_TRUE(script->answered(other));
    const std::size_t sent = script->sent.size();
    second = script->submit(17, read_at(2), 1);
    EXPECT_EQ(script->sent.size(), sent) << "what is owed may only now have reached its station";
    ASSERT_TRUE(script->next_sent(1s));
    EXPECT_EQ(script->sent.back().adu, modbus::encode_adu(17, read_at(2))) << "no more is needed";
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_return_test
