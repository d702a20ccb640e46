#include "pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "held_bus.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "shared.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::tcp_server::pipeline_test {
namespace {

/// Two answers in each millisecond.
class OwnAnswersTest : public testing::Test {
  protected:
    void wait(char name, bool wanted = true) {
        answers->wait([this, name, wanted] {
            if (wanted) given += name;
            return wanted;
        });
    }

    test::ManualClock clock;
    std::shared_ptr<OwnAnswers> answers = std::make_shared<OwnAnswers>(clock, 2, 1ms);
    std::string given;
};

TEST_F(OwnAnswersTest, P5AFewAreGivenAtOnceTheOthersInTheNextPeriods) {
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_FALSE(answers->try_acquire());
    for (const char name : {'a', 'b', 'c'}) wait(name);
    EXPECT_EQ(given, "");
    clock.advance(1ms);
    EXPECT_EQ(given, "ab");
    EXPECT_FALSE(answers->try_acquire()) << "one waits";
    clock.advance(1ms);
    EXPECT_EQ(given, "abc");
    EXPECT_TRUE(answers->try_acquire());
    EXPECT_EQ(clock.armed(), 0u);
    for (int n = 0; n < 10; ++n) {
        clock.pass(1ms);
        EXPECT_TRUE(answers->try_acquire()) << "who asks now and then never waits";
    }
}

TEST_F(OwnAnswersTest, P9ClientsThatHaveLeftCostTheOthersNoTurn) {
    answers->try_acquire();
    answers->try_acquire();
    for (int n = 0; n < 1000; ++n) wait('x', false);
    wait('a');
    clock.advance(1ms);
    EXPECT_EQ(given, "a");
}

TEST_F(OwnAnswersTest, NoAnswerIsRequestedAfterTheEnd) {
    answers->try_acquire();
    wait('a');
    answers.reset();
    clock.advance(1s);
    EXPECT_EQ(given, "");
}

/// A pipeline with two requests in flight and three queued, whose client takes replies on demand.
class SmallPipeline : public ::testing::Test {
  protected:
    static Settings small() {
        Settings settings;
        settings.lines = {"floor1"};
        settings.in_flight = 2;
        settings.waiting = 3;
        return settings;
    }
    void take_until_full() {
        while (pipeline->has_room()) pipeline->take({++taken, 1, "03 0000 0001"_hex});
    }
    void answer_all() {
        while (!bus.held.empty()) bus.answer(0, "03 02 0007"_hex);
    }

    boost::asio::io_context context;
    test::ManualClock clock;
    ManualBus bus{context};
    std::uint16_t taken = 0;
    int told = 0;
    std::shared_ptr<OwnAnswers> own_answers = std::make_shared<OwnAnswers>(clock, 1, 1ms);
    std::shared_ptr<Shared> shared = std::make_shared<Shared>(Shared{
        small(), UnitMap(small(), {{"floor1", &bus, {1}, true}}), {}, clock, {}, {}, own_answers});
    std::shared_ptr<Pipeline> pipeline = std::make_shared<Pipeline>(
        shared,
        Caller("10.0.0.7:5000", make_who({.face = Face::modbus_tcp,
                                          .name = "modbus_tcp 10.0.0.7:5000",
                                          .address = "10.0.0.7"})),
        [this] { ++told; });
};

TEST_F(SmallPipeline, P9WhatTheClientHasNotTakenIsStillInFlight) {
    take_until_full();
    EXPECT_EQ(taken, 5);
    EXPECT_EQ(bus.held.size(), 2U);
    answer_all();
    EXPECT_EQ(told, 2);
    EXPECT_EQ(bus.seen.size(), 2U) << "both replies wait for the client";
    EXPECT_FALSE(pipeline->has_room());
    pipeline->pop();
    EXPECT_EQ(bus.held.size(), 1U);
    EXPECT_TRUE(pipeline->has_room());
    take_until_full();
    EXPECT_EQ(taken, 6);
}

TEST_F(SmallPipeline, P3EverythingIsAnsweredInOrderHoweverSlowlyItIsTaken) {
    take_until_full();
    for (std::uint16_t next = 1; next <= 5; ++next) {
        answer_all();
        ASSERT_NE(pipeline->front(), nullptr);
        EXPECT_EQ((*pipeline->front())[1], next) << "the transaction";
        pipeline->pop();
    }
    EXPECT_TRUE(pipeline->empty());
    EXPECT_EQ(bus.seen.size(), 5U);
}

TEST_F(SmallPipeline, P5WhatNeedsNoLineIsAnsweredAFewTimesAMillisecond) {
    for (std::uint16_t n = 1; n <= 2; ++n) pipeline->take({n, 255, "03 0000 0001"_hex});
    ASSERT_NE(pipeline->front(), nullptr);
    pipeline->pop();
    EXPECT_EQ(pipeline->front(), nullptr) << "the next one is not due";
    EXPECT_EQ(told, 0);
    clock.advance(1ms);
    ASSERT_NE(pipeline->front(), nullptr);
    EXPECT_EQ(told, 1);
    pipeline->pop();
    EXPECT_TRUE(pipeline->empty());
}

TEST_F(SmallPipeline, TellsOnceOfAClientThatHasNoUnitId) {
    const rt::LogTap log;
    shared->units = UnitMap(small(), {{"floor1", &bus, {1}, false}});
    for (const std::uint8_t unit : Bytes{255, 0, 255, 7}) {
        pipeline->take({1, unit, "03 0000 0001"_hex});
        clock.advance(1ms);
        ASSERT_NE(pipeline->front(), nullptr);
        EXPECT_EQ(Bytes(pipeline->front()->end() - 2, pipeline->front()->end()), "83 0a"_hex);
        pipeline->pop();
    }
    EXPECT_THAT(log.lines(),
                testing::ElementsAre(testing::HasSubstr(
                    "client=10.0.0.7:5000 hint=\"asks unit 255: is no unit id set?\"")));
}

/// What the listener's `exceptions` leaves of a panel's exception and of two of the gateway's own.
class ExceptionsTest : public SmallPipeline {
  protected:
    /// Returns the exception codes that the client gets.
    Bytes told_with(Exceptions exceptions) {
        shared->settings.exceptions = exceptions;
        Bytes codes;
        for (const std::uint8_t unit : Bytes{1, 1, 77}) {
            pipeline->take({++taken, unit, "03 0000 0001"_hex});
            if (unit == 1)
                bus.answer(0, taken % 2 == 1 ? Result<Bytes>("83 02"_hex) : Fault::timeout);
            clock.advance(1ms);
            const Bytes* reply = pipeline->front();
            if (reply == nullptr) continue;
            codes.push_back(reply->back());
            pipeline->pop();
        }
        taken = 0;
        return codes;
    }
};

TEST_F(ExceptionsTest, OfThePanelsOnlyOrNone) {
    shared->units = UnitMap(small(), {{"floor1", &bus, {1}, false}});
    EXPECT_EQ(told_with(Exceptions::all), "02 0b 0a"_hex);
    EXPECT_EQ(told_with(Exceptions::own), "02"_hex);
    EXPECT_EQ(told_with(Exceptions::none), ""_hex);
    EXPECT_TRUE(pipeline->empty()) << "silence frees the place";
    EXPECT_EQ(shared->counters.unanswered, 5u);
}

/// Retransmissions: answers() lets the bus answer everything and counts the replies.
class RepeatedRequests : public SmallPipeline {
  protected:
    RepeatedRequests() {
        shared->settings.in_flight = 8;
        shared->settings.waiting = 8;
    }
    void take(const std::vector<modbus::Adu>& adus) {
        for (const modbus::Adu& adu : adus) pipeline->take(adu);
    }
    std::size_t answers() {
        std::size_t count = 0;
        do {
            answer_all();
            for (; pipeline->front() != nullptr; ++count) pipeline->pop();
        } while (!bus.held.empty());
        EXPECT_TRUE(pipeline->empty());
        return count;
    }
    const modbus::Adu write{7, 1, "06 0001 0002"_hex};
    const modbus::Adu read{8, 1, "03 0000 0001"_hex};
};

TEST_F(RepeatedRequests, P2ARetransmittedWriteGetsTheOneAnswerAndNoSecondFrame) {
    take({write, write, write});
    EXPECT_EQ(bus.seen.size(), 1U);
    EXPECT_EQ(answers(), 1U);
    pipeline->take(write);
    EXPECT_EQ(bus.seen.size(), 2U) << "the first is answered: this is another one";
    EXPECT_EQ(answers(), 1U);
}

TEST_F(RepeatedRequests, P9EndlessRetransmissionsAreThrottled) {
    for (int i = 0; i < 100 && pipeline->has_room(); ++i) pipeline->take(write);
    EXPECT_FALSE(pipeline->has_room());
    EXPECT_EQ(bus.seen.size(), 1U);
    EXPECT_EQ(answers(), 1U);
    EXPECT_TRUE(pipeline->has_room());
}

TEST_F(RepeatedRequests, P2OneThatStillWaitsForItsTurnIsKnownAgain) {
    shared->settings.in_flight = 1;
    take({read, write, write});
    answer_all();
    pipeline->pop();
    EXPECT_EQ(bus.seen.size(), 2U);
    EXPECT_EQ(answers(), 1U);
}

TEST_F(RepeatedRequests, AnotherIdUnitOrValueIsAnotherRequest) {
    take({write, {8, 1, write.pdu}, {9, 2, write.pdu}, {7, 1, "06 0001 0003"_hex}});
    EXPECT_EQ(bus.seen.size(), 4U);
    EXPECT_EQ(answers(), 4U);
    take({write, {7, 1, "06 0001 0000"_hex}, write});
    EXPECT_EQ(bus.seen.size(), 7U) << "a client that reuses one id may write on, off, on";
    EXPECT_EQ(answers(), 3U);
}

TEST_F(RepeatedRequests, ReadsAreAnsweredEachUnlessTheyAreToBeJoined) {
    take({read, read});
    EXPECT_EQ(answers(), 2U) << "the arbiter shares their transaction";
    shared->settings.retransmissions = Retransmissions::join;
    take({read, read});
    EXPECT_EQ(answers(), 1U);
}

TEST_F(RepeatedRequests, P6AReadThatIsRepeatedBehindAWriteOfItsItemsIsAskedAgain) {
    shared->settings.retransmissions = Retransmissions::join;
    for (const std::size_t places : {8u, 1u}) {  // in flight and queued
        shared->settings.in_flight = places;
        for (const Bytes& over : {"06 0000 0002"_hex, "0F 0000 0001 01 01"_hex, "41 01"_hex}) {
            take({read, {9, 1, over}, read});
            EXPECT_EQ(answers(), 3U) << over[0];
        }
        take({read, {9, 1, "06 0005 0002"_hex}, read});
        EXPECT_EQ(answers(), 2U) << "it has written something else";
    }
    EXPECT_EQ(shared->counters.joined, 2U);
}

TEST_F(RepeatedRequests, PassOrNoTransactionIdGivesEachATurnOfItsOwn) {
    shared->settings.retransmissions = Retransmissions::pass;
    take({write, write});
    EXPECT_EQ(bus.seen.size(), 2U);
    EXPECT_EQ(answers(), 2U);
    shared->settings.retransmissions = Retransmissions::join_writes;
    shared->settings.framing = modbus::Framing::rtu;
    take({{0, 1, write.pdu}, {0, 1, write.pdu}});
    EXPECT_EQ(bus.seen.size(), 4U);
}

}  // namespace
}  // namespace panelgate::tcp_server::pipeline_test
