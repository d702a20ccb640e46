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
    /// How long the line waited behind the frame that is sent next, until another one left.
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

TEST_F(SilenceTest, P4SoIsThatOfAnUnansweredWrite) {
    know(17);
    bus.submit(17, kWrite);
    bus.run_to_end_of_request();
    const TimePoint sent = bus.now();
    bus.submit(18, kRead, 2);
    EXPECT_GE(bus.next_sent().value().at - sent, kSilence);
}

TEST_F(SilenceTest, P4BeforeARetryTheRequestsThatWaitByThenHaveTheirTurns) {
    settings.stations.push_back(settings.unlisted);
    settings.stations.back().id = 19;
    BusScript line{settings};
    line.submit(17, kRead, 1);
    line.submit(18, kRead, 2);
    line.submit(19, kRead, 3);
    std::vector<std::uint8_t> asked;
    for (int i = 0; i < 3; ++i) {
        asked.push_back(line.next_sent().value().adu[0]);
        answer(line, asked.back(), reply_number(asked.back()), 3ms);
        if (i == 0) line.submit(18, read_at(7), 2);  // behind the silence
    }
    EXPECT_EQ(asked, (std::vector<std::uint8_t>{18, 19, 17}));
    EXPECT_EQ(line.next_sent().value().adu[0], 18);
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
    EXPECT_GE(bus.now() - silent, Duration(500ms));
    EXPECT_LE(bus.now() - silent, Duration(750ms));
}

TEST_F(SilenceTest, P4NothingElseGoesToTheStationBeforeItsRetry) {
    bus.submit(17, kRead, 1);
    bus.submit(17, kWrite, 2, PriorityClass::write);
    EXPECT_EQ(bus.next_sent().value().kind, FrameKind::retry);
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

TEST_F(SilenceTest, P4APanelThatIsBackHasAllItsRetriesAgain) {
    for (int i = 0; i < 2; ++i) {
        bus.submit(17, kRead);
        bus.run_for(2s);
    }
    know(17, 2);
    const std::size_t before = bus.sent.size();
    const Ticket asked = bus.submit(17, kRead);
    ASSERT_TRUE(bus.next_sent());
    answer(bus, 17, kReply, 3ms);
    EXPECT_TRUE(bus.answer(asked).pdu);
    EXPECT_EQ(bus.sent.size(), before + 2);
}

}  // namespace
}  // namespace panelgate::arbiter::silence_test
