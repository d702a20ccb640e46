#include "panelgate/mqtt/publisher.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "connection.hpp"
#include "mqtt_plant.hpp"

namespace panelgate::mqtt::publisher_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Settings settings() {
    Settings made;
    made.topic = "t";
    made.store = 5;
    return made;
}

class MqttPublisher : public ::testing::Test {
  protected:
    Publisher publisher_{settings(), small_plant()};

    void count(int from, int to) {
        for (int i = from; i <= to; ++i) publisher_.offer(3, good_number(i));
    }
    std::vector<Publisher::Outgoing> connect() {
        publisher_.connected();
        return take_all(publisher_);
    }
    void answer(const std::string& topic, bool refused = false) {
        publisher_.answer({topic, "", "{}"}, refused);
    }
    /// The values of t/press/mode among these.
    static std::vector<std::string> counted(const std::vector<Publisher::Outgoing>& all) {
        std::vector<std::string> values;
        for (const Publisher::Outgoing& one : all) {
            const std::string& text = one.message.payload;
            if (one.message.topic == "t/press/mode")
                values.push_back(text.substr(9, text.find(',') - 9));
        }
        return values;
    }
};

TEST_F(MqttPublisher, SendsNothingWithoutAConnection) {
    count(1, 2);
    EXPECT_THAT(take_all(publisher_), IsEmpty());
    EXPECT_EQ(publisher_.store().size(), 2U);
}

TEST_F(MqttPublisher, InitialStatesTakeNoRoomAndArePublishedByTheBirth) {
    publisher_.know(3, good_number(7));
    publisher_.know(3, good_number(8));  // a state is already known
    EXPECT_FALSE(publisher_.offer(3, good_number(7)));
    EXPECT_EQ(publisher_.store().size(), 0U);
    EXPECT_THAT(counted(connect()), ElementsAre("7"));
}

TEST_F(MqttPublisher, PublishesChangesOnly) {
    EXPECT_TRUE(publisher_.offer(3, good_number(1)));
    EXPECT_FALSE(publisher_.offer(3, good(std::int64_t{1}, kNoon + std::chrono::seconds(1))));
    State stale = good_number(1);
    stale.quality = points::Quality::stale;
    EXPECT_TRUE(publisher_.offer(3, stale));
}

TEST_F(MqttPublisher, ABirthEndsWithWhatIsNowBehindWhatHasBeen) {
    count(1, 3);
    const auto all = connect();
    EXPECT_EQ(all.front().message.topic, "t/status");
    EXPECT_THAT(counted(all), ElementsAre("1", "2", "3", "3"));
}

TEST_F(MqttPublisher, OnlyUnacknowledgedMessagesAreSentAgainInTheirOrder) {
    deliver(publisher_, connect());
    count(1, 3);
    auto all = take_all(publisher_);
    publisher_.delivered(all[1].change);
    publisher_.disconnected();
    count(4, 4);
    all = connect();
    EXPECT_THAT(counted(all), ElementsAre("1", "3", "4", "4"));
    deliver(publisher_, all);
    EXPECT_EQ(publisher_.store().size(), 0U);
    publisher_.disconnected();
    EXPECT_THAT(counted(connect()), ElementsAre("4"));
    EXPECT_EQ(publisher_.store().dropped(), 0U);
}

TEST_F(MqttPublisher, OfWhatDoesNotFitTheOldestThatWaitsGoesAndIsCounted) {
    connect();
    count(1, 1);
    take_all(publisher_);  // in flight: it is not dropped
    count(2, 8);
    EXPECT_EQ(publisher_.store().dropped(), 3U);
    publisher_.disconnected();
    EXPECT_THAT(counted(connect()), ElementsAre("1", "5", "6", "7", "8", "8"));
}

TEST_F(MqttPublisher, AChangeDuringABirthIsNotFollowedByWhatWasBefore) {
    count(1, 1);
    publisher_.offer(6, good(std::uint64_t{9}));
    publisher_.connected();
    std::vector<Publisher::Outgoing> all;
    for (int i = 0; i < 3; ++i) all.push_back(*publisher_.next(kNoon));  // status, both changes
    count(2, 2);
    for (auto& one : take_all(publisher_)) all.push_back(std::move(one));
    EXPECT_THAT(counted(all), ElementsAre("1", "2", "2"));
}

TEST_F(MqttPublisher, RepeatsWhatAWriterHasToSeeAgain) {
    connect();
    publisher_.repeat(3);  // it has no state
    EXPECT_THAT(take_all(publisher_), IsEmpty());
    count(1, 1);
    deliver(publisher_, take_all(publisher_));
    publisher_.repeat(3);
    EXPECT_THAT(counted(take_all(publisher_)), ElementsAre("1"));
}

TEST_F(MqttPublisher, AnotherPlantTakesOverWhatItHasToo) {
    connect();
    count(1, 1);
    take_all(publisher_);                         // in flight
    publisher_.offer(4, good(std::string("x")));  // of a point that is removed
    count(2, 2);
    Subjects fewer;
    fewer.add_station("oven");
    fewer.add_station("press");
    fewer.add_point(point("mode", points::Type::i16));
    Publisher next(settings(), fewer);
    next.take_over(publisher_);
    EXPECT_EQ(next.store().size(), 2U);
    EXPECT_FALSE(next.offer(2, good_number(2))) << "it is known";
    next.connected();
    EXPECT_THAT(counted(take_all(next)), ElementsAre("1", "2", "2"));
}

TEST_F(MqttPublisher, AnswersAreBoundedAndWhatFindsNoRoomIsCounted) {
    connect();
    for (std::size_t i = 0; i < settings().results + 3; ++i) answer("x");
    EXPECT_EQ(take_all(publisher_).size(), settings().results);
    EXPECT_EQ(publisher_.results_dropped(), 3U);
}

TEST_F(MqttPublisher, P2WhatWasRefusedTakesNoPlaceFromWhatWasCarriedOut) {
    const auto [results, writes] = std::pair(settings().results, settings().writes);
    for (std::size_t i = 0; i < 2 * results; ++i) answer("refused", true);
    EXPECT_TRUE(publisher_.has_room_for_answer(writes - 1));
    EXPECT_FALSE(publisher_.has_room_for_answer(writes));
    for (std::size_t i = 0; i < writes; ++i) answer("done");
    EXPECT_EQ(publisher_.results_dropped(), results + writes);
    EXPECT_FALSE(publisher_.has_room_for_answer(0));
}

TEST_F(MqttPublisher, P2AResultIsSentUntilTheBrokerHasIt) {
    connect();
    answer("t/a");
    answer("t/b");
    const auto first = publisher_.next(kNoon);
    ASSERT_TRUE(first && first->change != 0);
    take_all(publisher_);
    publisher_.delivered(first->change);
    publisher_.disconnected();  // before the broker has the second one
    answer("t/c");
    EXPECT_THAT(topics(connect()), ElementsAre("t/status", "t/b/result", "t/c/result"));
}

TEST_F(MqttPublisher, AnswersThatWaitGoWithTheirSessionToTheNextAtTheSameBroker) {
    connect();
    answer("t/a");
    Publisher next(settings(), small_plant());
    next.take_over(publisher_);
    next.disconnected();  // the broker cannot be reached yet
    next.answer({"t/b", "", "{}"}, false);
    next.connected();
    EXPECT_THAT(topics(take_all(next)), ElementsAre("t/status", "t/a/result", "t/b/result"));
    Settings elsewhere = settings();
    elsewhere.port = 1884;
    Publisher other(elsewhere, Subjects());
    other.take_over(publisher_);
    other.connected();
    EXPECT_THAT(topics(take_all(other)), ElementsAre("t/status"));
}

Subjects press_without_name() {
    Subjects subjects;
    subjects.add_line("floor1");
    subjects.add_station("press");
    for (const char* name : {"level", "mode"}) subjects.add_point(point(name, points::Type::u16));
    return subjects;
}

TEST_F(MqttPublisher, WhatIsConfiguredNoMoreIsClearedOnce) {
    Publisher next(settings(), press_without_name());
    next.take_over(publisher_);
    for (int i = 0; i < 2; ++i) {
        next.disconnected();  // the second time before the broker has it
        next.connected();
        const auto all = take_all(next);
        ASSERT_THAT(topics(all), ElementsAre("t/status", "t/oven/level", "t/press/name",
                                             "t/station/oven/state"));
        EXPECT_EQ(all[1].message, (Message{"t/oven/level", "", 1, true}));
        if (i == 1) deliver(next, all);
    }
    next.disconnected();
    next.connected();
    EXPECT_THAT(topics(take_all(next)), ElementsAre("t/status"));
}

TEST_F(MqttPublisher, WhatIsNotClearedYetIsClearedByTheNextUnlessItIsBack) {
    Publisher next(settings(), press_without_name());
    next.take_over(publisher_);
    Settings moved = settings();
    moved.topic = "u";
    Publisher elsewhere(moved, Subjects());
    elsewhere.take_over(next);
    elsewhere.connected();
    EXPECT_THAT(topics(take_all(elsewhere)),
                ElementsAre("u/status", "t/line/floor1/state", "t/oven/level", "t/press/level",
                            "t/press/mode", "t/press/name", "t/station/oven/state",
                            "t/station/press/state", "t/status"));
    Publisher back(settings(), small_plant());
    back.take_over(next);
    back.connected();
    EXPECT_THAT(topics(take_all(back)), ElementsAre("t/status"));
}

TEST(MqttKept, AcknowledgementsOfNothingMeanNothing) {
    Kept<int> kept(1, 3);
    kept.delivered(1);
    kept.add(5);
    kept.delivered(1);  // it was never sent
    kept.delivered(7);
    EXPECT_EQ(kept.size(), 1U);
    kept.delivered(kept.next()->first);
    EXPECT_EQ(kept.next(), nullptr);
    EXPECT_EQ(kept.dropped(), 0U);
}

TEST(MqttOpenMessages, AreOpenUntilTheyAreAcknowledged) {
    OpenMessages open;
    open.sent(1, true, 11);
    open.sent(2, true, 0);
    EXPECT_EQ(open.size(), 2U);
    EXPECT_FALSE(open.wants_barrier());
    EXPECT_THAT(open.delivered(7), IsEmpty());
    EXPECT_THAT(open.delivered(1), ElementsAre(11));
    EXPECT_THAT(open.delivered(1), IsEmpty());
    EXPECT_EQ(open.size(), 1U);
    open.clear();
    EXPECT_EQ(open.size(), 0U);
}

TEST(MqttOpenMessages, ABarrierAcknowledgesWhatIsBeforeIt) {
    OpenMessages open;
    open.sent(1, false, 11);
    open.sent(2, false, 12);
    EXPECT_TRUE(open.wants_barrier());
    open.barrier(0);  // not sent
    EXPECT_TRUE(open.wants_barrier());
    open.barrier(3);
    open.sent(4, false, 13);
    EXPECT_FALSE(open.wants_barrier()) << "one at a time";
    EXPECT_THAT(open.delivered(1), IsEmpty());
    EXPECT_THAT(open.delivered(3), ElementsAre(11, 12));
    EXPECT_TRUE(open.wants_barrier());
    EXPECT_EQ(open.size(), 1U);
}

}  // namespace
}  // namespace panelgate::mqtt::publisher_test
