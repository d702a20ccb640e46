#include "panelgate/mqtt/subjects.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace panelgate::mqtt::store_test {
namespace {

using ::testing::ElementsAre;

State text(const std::string& word) {
    State state;
    state.text = word;
    return state;
}

/// Returns all changes sent from now on, in order; they are then in flight.
std::vector<std::string> send_all(Store& store) {
    std::vector<std::string> sent;
    while (const Change* change = store.next()) {
        sent.push_back(change->state.text);
        store.sent();
    }
    return sent;
}

TEST(MqttStore, GivesChangesInTheirOrder) {
    Store store(10);
    store.add(1, text("a"));
    store.add(0, text("b"));
    store.add(1, text("c"));
    EXPECT_THAT(send_all(store), ElementsAre("a", "b", "c"));
    EXPECT_EQ(store.in_flight(), 3U);
}

TEST(MqttStore, KeepsWhatIsNotAcknowledgedAndSendsItAgainInItsOrder) {
    Store store(10);
    for (const char* word : {"a", "b", "c"}) store.add(0, text(word));
    send_all(store);
    store.delivered(2);  // b
    store.lost();
    store.add(0, text("d"));
    EXPECT_THAT(send_all(store), ElementsAre("a", "c", "d"));
    for (const std::uint64_t number : {1U, 3U, 4U}) store.delivered(number);
    EXPECT_EQ(store.size(), 0U);
    EXPECT_EQ(store.dropped(), 0U);
}

TEST(MqttStore, WhenItIsFullTheOldestThatWaitsGoesAndIsCounted) {
    Store store(3);
    for (const char* word : {"a", "b", "c", "d", "e"}) store.add(0, text(word));
    EXPECT_EQ(store.dropped(), 2U);
    EXPECT_THAT(send_all(store), ElementsAre("c", "d", "e"));
}

TEST(MqttStore, WhatIsOnItsWayIsNotDropped) {
    Store store(3);
    store.add(0, text("a"));
    store.sent();
    for (const char* word : {"b", "c", "d"}) store.add(0, text(word));
    EXPECT_EQ(store.dropped(), 1U);
    store.lost();
    EXPECT_THAT(send_all(store), ElementsAre("a", "c", "d"));
}

TEST(MqttStore, AcknowledgementsOfNothingMeanNothing) {
    Store store(3);
    store.delivered(1);
    store.add(0, text("a"));
    store.delivered(1);  // it was never sent
    store.delivered(7);
    EXPECT_EQ(store.size(), 1U);
    store.skip();
    EXPECT_EQ(store.next(), nullptr);
    EXPECT_EQ(store.dropped(), 0U);
}

}  // namespace
}  // namespace panelgate::mqtt::store_test
