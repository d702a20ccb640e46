#include "admission.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace panelgate::web::places_test {
namespace {

using Id = Places::Id;

class PlacesTest : public ::testing::Test {
  protected:
    PlacesTest() {
        Settings settings;
        settings.max_connections = 3;
        settings.max_connections_per_address = 2;
        settings.max_streams_per_address = 2;
        settings.max_throttled = 2;
        settings.probe_places = 2;
        places.emplace(settings);
    }
    Places::Arrival come(Id id, const std::string& address) { return places->arrive(id, address); }
    void fill_and_keep_busy() {
        come(1, "a");
        come(2, "a");
        come(3, "b");
        for (Id id = 1; id <= 3; ++id) places->busy(id);
    }
    std::optional<Places> places;
};

TEST_F(PlacesTest, HasRoomUpToItsLimit) {
    for (const auto& arrival : {come(1, "a"), come(2, "a"), come(3, "b")}) {
        EXPECT_FALSE(arrival.probes_only);
        EXPECT_FALSE(arrival.leaves);
    }
}

TEST_F(PlacesTest, TakesThePlaceOfTheLongestIdleOne) {
    come(1, "a");
    come(2, "b");
    come(3, "c");
    places->busy(1);
    places->idle(1);
    EXPECT_EQ(come(4, "d").leaves, 2u);
    EXPECT_EQ(come(5, "d").leaves, 3u);
    EXPECT_EQ(come(6, "e").leaves, 1u);
}

TEST_F(PlacesTest, LetsAnAddressWithManyConnectionsDisplaceOnlyItsOwn) {
    come(1, "b");
    come(2, "a");
    come(3, "a");
    const auto arrival = come(4, "a");
    EXPECT_EQ(arrival.leaves, 2u);
    EXPECT_FALSE(arrival.probes_only);
}

TEST_F(PlacesTest, DisplacesNoneThatHasARequest) {
    fill_and_keep_busy();
    for (const auto& arrival : {come(4, "a"), come(5, "c")}) {
        EXPECT_TRUE(arrival.probes_only);
        EXPECT_FALSE(arrival.leaves);
    }
    places->idle(3);
    EXPECT_EQ(come(6, "c").leaves, 3u);
}

TEST_F(PlacesTest, GivesThePlaceOfAWrongTokenAndLeavesItItsConnection) {
    come(1, "a");
    come(2, "a");
    for (const Id id : {1u, 2u}) places->busy(id);
    places->wrong(2);
    EXPECT_TRUE(places->is_throttled(2));
    const auto arrival = come(3, "a");
    EXPECT_FALSE(arrival.leaves);
    EXPECT_FALSE(arrival.probes_only);
    places->busy(3);
    EXPECT_TRUE(come(4, "a").probes_only) << "the place is taken once";
}

TEST_F(PlacesTest, ThrottlesALimitedNumberPerAddressAndThenDropsTheOldest) {
    for (const Id id : {1u, 2u}) {
        come(id, "a");
        places->wrong(id);
    }
    EXPECT_EQ(come(3, "a").leaves, 1u);
    EXPECT_FALSE(places->is_throttled(1));
    places->wrong(3);
    EXPECT_FALSE(come(4, "b").leaves);
}

TEST_F(PlacesTest, OfAFullHouseTakesThePlaceOfAWrongTokenBeforeAllOthers) {
    come(1, "b");
    come(2, "a");
    come(3, "a");
    for (const Id id : {2u, 3u}) places->busy(id);
    places->wrong(2);
    EXPECT_EQ(come(4, "c").leaves, 2u) << "though the first has been idle for longer";
    EXPECT_EQ(come(5, "d").leaves, 1u);
}

TEST_F(PlacesTest, TakesThePlaceOfAGuessingAddressForAnotherOnly) {
    fill_and_keep_busy();
    places->suspect(2);
    EXPECT_TRUE(come(4, "a").probes_only);
    const auto arrival = come(5, "c");
    EXPECT_EQ(arrival.leaves, 2u);
    EXPECT_FALSE(arrival.probes_only);
}

TEST_F(PlacesTest, KeepsThePlaceOfATokenThatWasFoundRight) {
    fill_and_keep_busy();
    places->suspect(2);
    places->busy(2);
    EXPECT_TRUE(come(4, "c").probes_only);
}

TEST_F(PlacesTest, HasAlwaysAPlaceForAProbe) {
    fill_and_keep_busy();
    for (Id id = 4; id < 100; ++id) {
        const auto arrival = come(id, "a");
        EXPECT_TRUE(arrival.probes_only);
        EXPECT_EQ(arrival.leaves, id < 6 ? std::nullopt : std::optional<Id>(id - 2));
        places->busy(id);
    }
}

TEST_F(PlacesTest, ReusesThePlaceOfAClosedConnection) {
    fill_and_keep_busy();
    places->leave(1);
    EXPECT_FALSE(come(4, "a").probes_only);
    places->busy(4);
    places->leave(1);
    places->busy(1);
    places->idle(1);
    EXPECT_TRUE(come(5, "a").probes_only);
}

/// A proxy is one address, and each tab keeps a stream open all day.
TEST_F(PlacesTest, AnEventStreamTakesNoPlaceOfItsAddress) {
    for (Id id = 1; id <= 2; ++id) {
        come(id, "a");
        places->busy(id);
        EXPECT_TRUE(places->stream(id));
    }
    const auto arrival = come(3, "a");
    EXPECT_FALSE(arrival.probes_only);
    EXPECT_FALSE(arrival.leaves);
    EXPECT_FALSE(places->stream(3)) << "more than it may";
    places->leave(1);
    EXPECT_TRUE(places->stream(3));
}

}  // namespace
}  // namespace panelgate::web::places_test
