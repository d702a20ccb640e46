// What a silence costs (P4, T1): each is waited for in full, and asked for seldom.
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::silence_test {
namespace {

constexpr std::uint8_t kStranger = 40;

class SilenceTest : public ArbiterTest {
  protected:
    /// How long the line waits behind the next frame, until the next but one leaves.
    Duration next_wait() {
        EXPECT_TRUE(bus.next_sent());
        bus.run_to_end_of_request();
        const TimePoint sent = bus.now();
        bus.submit(18, read_at(++number), 9);
        while (bus.sent.back().adu[0] != 18) EXPECT_TRUE(bus.next_sent());
        const Duration waited = bus.sent.back().at - sent;
        answer(bus, 18, reply_number(number), 3ms);
        return waited;
    }
    void know(std::uint8_t station, int replies = 20) {
        for (int i = 0; i < replies; ++i) {
            bus.submit(station, read_at(++number));
            if (bus.sent.empty() || bus.sent.back().adu[0] != station ||
                !bus.arbiter().is_waiting())
                bus.next_sent();
            answer(bus, station, reply_number(number), 3ms);
            bus.run_for(10ms);
        }
    }
    unsigned number = 0;
};

TEST_F(SilenceTest, P4ASilenceOfAQuickStationIsWaitedForAsLongAsItsNeighboursDo) {
    know(17);
    know(18);
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    const TimePoint sent = bus.now();
    bus.submit(18, kRead, 2);
    EXPECT_GE(bus.next_sent().value().at - sent, kSilence);
}

TEST_F(SilenceTest, P4SoIsThatOfAProbeOfAnOfflineStation) {
    know(17);
    know(18);
    while (!bus.arbiter().health(17).offline()) {
        bus.try_submit(17, kRead);
        bus.run_for(600ms);
    }
    for (int i = 0; i < 5; ++i) EXPECT_GE(next_wait(), kSilence) << i;
}

TEST_F(SilenceTest, P4SoIsThatOfAnAddressThatNobodyListed) {
    know(18);
    const TimePoint start = bus.now();
    const Ticket asked = bus.submit(kStranger, kRead);
    answer(bus, kStranger, kReply, 490ms);
    EXPECT_EQ(bus.answer(asked).pdu.value(), kReply);
    for (std::uint8_t id = kStranger + 1; id < kStranger + 5; ++id) {
        bus.submit(id, kRead, 2);
        while (bus.sent.back().adu[0] != id) ASSERT_TRUE(bus.next_sent());
        bus.run_to_end_of_request();
        const TimePoint sent = bus.now();
        bus.submit(18, kRead, 3);
        EXPECT_GE(bus.next_sent().value().at - sent, kSilence);
        answer(bus, 18, kReply, 3ms);
    }
    EXPECT_LT(bus.now() - start, 30s);
}

/// Two panels had died: their retries went one behind the other, and a sound one waited for four
/// timeouts.
TEST_F(SilenceTest, P4BetweenTwoSilencesAStationThatAnswersHasItsTurn) {
    know(18);
    bus.submit(17, kRead, 1);
    bus.submit(kStranger, kRead, 2);
    bus.submit(18, read_at(1), 3);
    std::uint8_t before = 0;
    for (int silences = 0; silences < 3;) {
        const std::uint8_t asked = bus.sent.back().adu[0];
        EXPECT_FALSE(before != 18 && before != 0 && asked != 18) << "silences " << silences;
        before = asked;
        if (asked != 18) {
            ++silences;
        } else {
            answer(bus, 18, reply_number(1), 3ms);
            bus.submit(18, read_at(1), 3);
        }
        ASSERT_TRUE(bus.next_sent());
    }
}

TEST_F(SilenceTest, P4OthersGoBeforeARetryForNoLongerThanATimeout) {
    for (int i = 0; i < 12; ++i) know(18, 1);
    bus.submit(17, kRead, 1);
    for (unsigned i = 0; i < 8; ++i) bus.submit(18, read_at(100 + i), 2 + i);
    bus.next_sent();
    const TimePoint silent = bus.now();
    while (bus.sent.back().adu[0] == 18) {
        answer(bus, 18, reply_number(++number), 200ms);
        ASSERT_TRUE(bus.next_sent());
    }
    EXPECT_EQ(bus.sent.back().kind, FrameKind::retry);
    EXPECT_GE(bus.now() - silent, Duration(200ms));
    EXPECT_LE(bus.now() - silent, Duration(600ms));
}

TEST_F(SilenceTest, P4WhereTwoRetriesWereAnsweredTheNextOneGoesFirst) {
    know(18);
    for (const bool answered : {false, false, true}) {
        bus.submit(17, read_at(1), 1);
        bus.submit(18, read_at(2), 2);
        EXPECT_EQ(bus.next_sent().value().adu[0], answered ? 17 : 18) << "the line loses frames";
        for (int i = 0; i < 2; ++i) {
            if (i > 0) ASSERT_TRUE(bus.next_sent());
            answer(bus, bus.sent.back().adu[0], reply_number(1), 3ms);
        }
        bus.run_for(2s);
    }
}

TEST_F(SilenceTest, P4ASuspectIsNotRetried) {
    know(18);
    bus.submit(17, kRead);
    bus.run_for(2s);
    const std::size_t before = bus.sent.size();
    bus.submit(17, kRead);
    bus.run_for(2s);
    EXPECT_EQ(bus.sent.size(), before + 1);
}

/// Takes station 17 offline.
void silence(BusScript& bus, const Bytes& request = kRead) {
    while (!bus.arbiter().health(17).offline()) {
        if (bus.arbiter().idle()) bus.submit(17, request, 7);
        bus.run_for(100ms);
    }
}

TEST_F(ArbiterTest, P4AfterThreeSilentTransactionsTheAnswerIsImmediate) {
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        bus.run_for(3s);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::offline);
    const std::size_t frames = bus.sent.size();
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    EXPECT_EQ(bus.sent.size(), frames);
}

TEST_F(ArbiterTest, P4QueuedRequestsOfAStationThatGoesOfflineAreAnsweredAtOnce) {
    settings.queue.deadline = 60s;
    BusScript script{settings};
    std::vector<Ticket> tickets;
    for (unsigned i = 0; i < 6; ++i) tickets.push_back(script.submit(17, read_at(i), i + 1));
    while (!script.arbiter().health(17).offline()) script.run_for(10ms);
    for (const Ticket ticket : tickets) EXPECT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(tickets[5]).pdu.error(), Fault::offline);
    EXPECT_FALSE(script.answer(tickets[5]).transmitted);
}

TEST_F(ArbiterTest, P4ProbesOfASilentStationStayBelowTheirShareAndOneReplyBringsItBack) {
    silence(bus);
    const std::size_t before = bus.sent.size();
    const Duration busy = bus.arbiter().counters().busy;
    bus.run_for(1000s);
    EXPECT_GT(bus.sent.size(), before + 10) << "it is asked again and again";
    EXPECT_LT(to_seconds(bus.arbiter().counters().busy - busy), 0.05 * 1000);
    answer_next(bus, 17, kReply);
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::online);
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_TRUE(bus.next_sent(1s));
    answer(bus, 17, kReply);
    EXPECT_TRUE(bus.answer(ticket).pdu.has_value());
}

TEST_F(ArbiterTest, P4AStationThatIsBackIsUsedAtOnceThoughItsSilencesHaveCostMuch) {
    const auto ask = [&](std::uint8_t station) {
        const Ticket ticket = bus.submit(station, kRead);
        answer(bus, station, kReply, 3ms);
        EXPECT_TRUE(bus.answer(ticket).pdu);
        bus.run_for(10ms);
    };
    ask(17);
    silence(bus);
    ask(18);
    while (bus.sent.back().kind != FrameKind::probe) ASSERT_TRUE(bus.next_sent());
    answer(bus, 17, kReply, 3ms);
    bus.run_for(10ms);
    ask(18);
    ask(17);
}

TEST_F(ArbiterTest, P4AWriteMayBeTheProbeOnceAnInterval) {
    settings.offline.probe_min = settings.offline.probe_max = 60s;
    BusScript bus{settings};
    bus.submit(17, kRead);
    answer(bus, 17, kReply, 3ms);
    silence(bus);
    bus.run_for(90s);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    const Ticket write = bus.submit(17, kWrite);
    EXPECT_EQ(bus.try_submit(17, kWrite).error(), Fault::offline);
    while (bus.sent.back().adu[1] != 6) ASSERT_TRUE(bus.next_sent());
    answer(bus, 17, kWrite, 3ms);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::online);
}

TEST_F(ArbiterTest, P4ADamagedReplyIsNotSilence) {
    for (int i = 0; i < 5; ++i) {
        bus.submit(17, kRead);
        for (int attempt = 0; attempt < 2; ++attempt) {
            if (attempt > 0) ASSERT_TRUE(bus.next_sent());
            bus.run_to_end_of_request();
            bus.hear(ByteView(modbus::encode_adu(17, kReply)).first(6));
        }
        bus.run_for(30ms);
    }
    EXPECT_FALSE(bus.arbiter().health(17).offline());
}

TEST_F(ArbiterTest, AnAdaptiveTimeoutAnswersTheClientEarlyAndStillWaitsForALateReply) {
    settings.stations.clear();
    settings.unlisted.adaptive_timeout = true;
    settings.unlisted.retries = 0;
    BusScript script(settings);
    for (int i = 0; i < 20; ++i) {
        script.submit(17, kRead);
        answer(script, 17, kReply, 3ms);
        script.run_for(3ms);
    }
    EXPECT_LT(script.arbiter().response_timeout(17), Duration(40ms));
    const Ticket silent = script.submit(17, kRead, 1);
    const TimePoint start = script.now();
    const Ticket other = script.submit(18, kRead, 2);
    const auto next = script.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18) << "the others need not wait for the whole timeout";
    EXPECT_LT(next->at - start, Duration(100ms));
    EXPECT_TRUE(script.answered(silent));
    answer(script, 18, kReply, 3ms);
    EXPECT_TRUE(script.answered(other));
    script.submit(17, kRead, 1);
    EXPECT_EQ(script.next_sent().value().kind, FrameKind::probe)
        << "another length shows what is late";
    EXPECT_GT(script.next_sent().value().at - start, Duration(900ms)) << "where it is not answered";
}

}  // namespace
}  // namespace panelgate::arbiter::silence_test
