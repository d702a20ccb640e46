#include "panelgate/mqtt/publisher.hpp"

#include <gmock/gmock.h>

#include "mqtt_plant.hpp"

namespace panelgate::mqtt::publisher_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
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
        for (int i = from; i <= to; ++i) publisher_.offer(3, good(std::int64_t{i}));
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
    void deliver(const std::vector<Publisher::Outgoing>& all) {
        for (const Publisher::Outgoing& one : all) publisher_.delivered(one.change);
    }
};

TEST_F(MqttPublisher, SendsNothingWithoutAConnection) {
    count(1, 2);
    EXPECT_THAT(take_all(publisher_), IsEmpty());
    EXPECT_EQ(publisher_.store().size(), 2U);
}

TEST_F(MqttPublisher, InitialStatesTakeNoRoomAndArePublishedByTheBirth) {
    publisher_.know(3, good(std::int64_t{7}));
    publisher_.know(3, good(std::int64_t{8}));  // a state is already known
    EXPECT_FALSE(publisher_.offer(3, good(std::int64_t{7})));
    EXPECT_EQ(publisher_.store().size(), 0U);
    publisher_.connected();
    EXPECT_THAT(counted(take_all(publisher_)), ElementsAre("7"));
}

TEST_F(MqttPublisher, PublishesChangesOnly) {
    EXPECT_TRUE(publisher_.offer(3, good(std::int64_t{1})));
    EXPECT_FALSE(publisher_.offer(3, good(std::int64_t{1}, kNoon + std::chrono::seconds(1))));
    State stale = good(std::int64_t{1});
    stale.quality = points::Quality::stale;
    EXPECT_TRUE(publisher_.offer(3, stale));
}

TEST_F(MqttPublisher, ABirthEndsWithWhatIsNowBehindWhatHasBeen) {
    count(1, 3);
    publisher_.connected();
    const auto all = take_all(publisher_);
    EXPECT_EQ(all.front().message.topic, "t/status");
    EXPECT_THAT(counted(all), ElementsAre("1", "2", "3", "3"));
}

TEST_F(MqttPublisher, OnlyUnacknowledgedMessagesAreSentAgain) {
    publisher_.connected();
    deliver(take_all(publisher_));
    count(1, 3);
    auto all = take_all(publisher_);
    publisher_.delivered(all[0].change);
    publisher_.disconnected();
    count(4, 4);
    publisher_.connected();
    all = take_all(publisher_);
    EXPECT_THAT(counted(all), ElementsAre("2", "3", "4", "4"));
    deliver(all);
    publisher_.disconnected();
    publisher_.connected();
    EXPECT_THAT(counted(take_all(publisher_)), ElementsAre("4"));
}

TEST_F(MqttPublisher, OfWhatDoesNotFitTheOldestGoesAndIsCounted) {
    count(1, 8);
    EXPECT_EQ(publisher_.store().dropped(), 3U);
    publisher_.connected();
    EXPECT_THAT(counted(take_all(publisher_)), ElementsAre("4", "5", "6", "7", "8", "8"));
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
    publisher_.connected();
    take_all(publisher_);
    publisher_.repeat(3);  // it has no state
    EXPECT_THAT(take_all(publisher_), IsEmpty());
    count(1, 1);
    deliver(take_all(publisher_));
    publisher_.repeat(3);
    EXPECT_THAT(counted(take_all(publisher_)), ElementsAre("1"));
}

TEST_F(MqttPublisher, AnotherPlantTakesOverWhatItHasToo) {
    publisher_.connected();
    take_all(publisher_);
    count(1, 1);
    take_all(publisher_);                         // in flight
    publisher_.offer(4, good(std::string("x")));  // of a point that is removed
    count(2, 2);
    Subjects fewer;
    fewer.add_station("oven");
    fewer.add_station("press");
    points::Point mode;
    mode.name = "mode";
    mode.type = points::Type::i16;
    fewer.add_point(mode);
    Publisher next(settings(), fewer);
    next.take_over(publisher_);
    EXPECT_EQ(next.store().size(), 2U);
    EXPECT_FALSE(next.offer(2, good(std::int64_t{2}))) << "it is known";
    next.connected();
    EXPECT_THAT(counted(take_all(next)), ElementsAre("1", "2", "2"));
}

TEST_F(MqttPublisher, AnswersAreBoundedAndWhatFindsNoRoomIsCounted) {
    publisher_.connected();
    take_all(publisher_);
    for (std::size_t i = 0; i < settings().results + 3; ++i)
        publisher_.answer({"x", "", "{}"}, false);
    EXPECT_EQ(take_all(publisher_).size(), settings().results);
    EXPECT_EQ(publisher_.results_dropped(), 3U);
}

TEST_F(MqttPublisher, P2WhatWasRefusedTakesNoPlaceFromWhatWasCarriedOut) {
    const std::size_t all = settings().results;
    for (std::size_t i = 0; i < 2 * all; ++i) publisher_.answer({"refused", "", "{}"}, true);
    EXPECT_TRUE(publisher_.has_room_for_answer(settings().writes - 1));
    EXPECT_FALSE(publisher_.has_room_for_answer(settings().writes));
    for (std::size_t i = 0; i < settings().writes; ++i)
        publisher_.answer({"done", "", "{}"}, false);
    EXPECT_EQ(publisher_.results_dropped(), all + settings().writes);
    EXPECT_FALSE(publisher_.has_room_for_answer(0));
}

TEST_F(MqttPublisher, P2AResultIsSentUntilTheBrokerHasIt) {
    publisher_.connected();
    take_all(publisher_);
    publisher_.answer({"t/a", "", "{}"}, false);
    publisher_.answer({"t/b", "", "{}"}, false);
    const auto first = publisher_.next(kNoon);
    ASSERT_TRUE(first && first->change != 0);
    take_all(publisher_);
    publisher_.delivered(first->change);
    publisher_.disconnected();  // before the broker has the second one
    publisher_.answer({"t/c", "", "{}"}, false);
    publisher_.connected();
    EXPECT_THAT(topics(take_all(publisher_)), ElementsAre("t/status", "t/b/result", "t/c/result"));
}

TEST_F(MqttPublisher, AnswersThatWaitGoWithTheirSessionToTheNext) {
    publisher_.connected();
    take_all(publisher_);
    publisher_.answer({"t/a", "", "{}"}, false);
    Publisher next(settings(), small_plant());
    next.take_over(publisher_);
    next.disconnected();  // the broker cannot be reached yet
    next.answer({"t/b", "", "{}"}, false);
    next.connected();
    EXPECT_THAT(topics(take_all(next)), ElementsAre("t/status", "t/a/result", "t/b/result"));
}

TEST_F(MqttPublisher, AnotherBrokerGetsNoResultsOfThisOne) {
    publisher_.connected();
    publisher_.answer({"t/a", "", "{}"}, false);
    Settings other = settings();
    other.port = 1884;
    Publisher next(other, Subjects());
    next.take_over(publisher_);
    next.connected();
    EXPECT_THAT(topics(take_all(next)), ElementsAre("t/status"));
}

Subjects press_without_name() {
    Subjects subjects;
    subjects.add_line("floor1");
    subjects.add_station("press");
    for (const char* name : {"level", "mode"}) {
        points::Point point;
        point.name = name;
        subjects.add_point(point);
    }
    return subjects;
}

TEST_F(MqttPublisher, WhatIsConfiguredNoMoreIsClearedOnce) {
    Publisher next(settings(), press_without_name());
    next.take_over(publisher_);
    next.connected();
    EXPECT_THAT(topics(take_all(next)),
                ElementsAre("t/status", "t/oven/level", "t/press/name", "t/station/oven/state"));
    next.disconnected();  // before the broker has it
    next.connected();
    const auto all = take_all(next);
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(all[1].message, (Message{"t/oven/level", "", 1, true}));
    for (const Publisher::Outgoing& one : all) next.delivered(one.change);
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

}  // namespace
}  // namespace panelgate::mqtt::publisher_test
