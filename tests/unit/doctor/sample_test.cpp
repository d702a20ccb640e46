#include "panelgate/doctor/doctor.hpp"

#include <gtest/gtest.h>

#include "case.hpp"

namespace panelgate::doctor::sample_test {
namespace {

using arbiter::Symptoms;

TEST(Sample, ADifferenceCountsWhatCameBetweenAndKeepsWhatIsNow) {
    Sample before, after;
    before.stations[1] = Mix().answered(10, 0).silent(3).late(2, 50ms);
    after.stations[1] = Mix().answered(15, 0).silent(7).late(3, 60ms);
    after.stations[2] = Mix().damaged(4);
    after.uart = line::UartErrors{9, 8, 7, 6};
    before.broadcasts = 4;
    after.broadcasts = 6;
    const Sample window = difference(after, before);
    const Symptoms& one = window.stations.at(1);
    EXPECT_EQ(one.answered, 5u);
    EXPECT_EQ(one.answered_after[0], 5u);
    EXPECT_EQ(one.silent, 4u);
    EXPECT_EQ(one.late, 1u);
    EXPECT_EQ(one.mute_in_a_row, 7u);
    EXPECT_EQ(one.worst_lateness, Duration(60ms));
    EXPECT_EQ(window.stations.at(2).damaged(), 4u);
    EXPECT_EQ(window.attempts(), 13u);
    EXPECT_EQ(window.broadcasts, 2u);
    EXPECT_EQ(window.uart, (line::UartErrors{9, 8, 7, 6}));
    EXPECT_EQ(difference(after, after).attempts(), 0u);
    EXPECT_EQ(difference(after, after).uart, (line::UartErrors{}));
    EXPECT_EQ(window.total().worst_lateness, Duration(60ms));
}

TEST(Sample, ATotalAddsWhatIsCountedAndTakesTheWorstOfTheRest) {
    Sample sample;
    sample.stations[1] = Mix().answered(10, 0).late(2, 50ms);
    sample.stations[2] = Mix().lost(3, 1).late(1, 80ms);
    sample.stations[0] = Mix().lost(9, 1).with(&Symptoms::mute_in_a_row, 9);
    const Symptoms total = sample.total();
    EXPECT_EQ(total.answered, 10u);
    EXPECT_EQ(total.silent, 12u);
    EXPECT_EQ(total.late, 3u);
    EXPECT_EQ(total.answered_after[0], 10u);
    EXPECT_EQ(total.silent_after[1], 12u);
    EXPECT_EQ(total.mute_in_a_row, 9u) << "of one station, not of all";
    EXPECT_EQ(total.worst_lateness, Duration(80ms));
    EXPECT_EQ(sample.attempts(), 22u);
    EXPECT_EQ(Sample().total(), Symptoms());
}

TEST(Sample, ADriverThatBeganToCountCountsFromZero) {
    Sample before, after;
    after.uart = line::UartErrors{4, 3, 2, 1};
    EXPECT_EQ(difference(after, before).uart, (line::UartErrors{4, 3, 2, 1}));
    EXPECT_FALSE(difference(before, after).uart) << "and one that stopped tells nothing";
}

}  // namespace
}  // namespace panelgate::doctor::sample_test
