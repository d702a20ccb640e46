#include "panelgate/points/heard_values.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string_view>

namespace panelgate::points::heard_values_test {
namespace {

using modbus::Table;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimePoint kStart{1h};

/// Requested at this time, answered 10 ms later.
tap::Transaction heard(Duration at, std::string_view request, std::string_view reply) {
    tap::Transaction made;
    made.station = 5;
    made.request = *from_hex(request);
    made.reply = *from_hex(reply);
    made.end = reply.empty() ? tap::End::silent : tap::End::answered;
    made.asked = made.sampled = kStart + at;
    made.sent = made.asked + 2ms;
    made.ended = made.asked + 10ms;
    return made;
}

class HeardValuesTest : public testing::Test {
  protected:
    HeardValues values{{{{Table::holding_registers, 100, 1}, 1s},
                        {{Table::holding_registers, 102, 2}, 1s},
                        {{Table::coils, 7, 1}, 1s}}};
    Quality quality(std::size_t want, Duration at) const {
        return quality_of(values.readings()[want], 1s, kStart + at);
    }
};

TEST_F(HeardValuesTest, AReadThatCoversAWantIsItsValue) {
    EXPECT_THAT(values.on_heard(heard(0ms, "03 0064 0004", "03 08 0001 0002 0003 0004")),
                ElementsAre(0, 1));
    EXPECT_THAT(values.readings()[0].values, ElementsAre(1));
    EXPECT_THAT(values.readings()[1].values, ElementsAre(3, 4));
    EXPECT_EQ(values.readings()[1].sampled, kStart);
    EXPECT_EQ(quality(0, 1s), Quality::good);
    EXPECT_EQ(quality(0, 5s), Quality::stale);
    EXPECT_EQ(quality(2, 1s), Quality::bad);
}

TEST_F(HeardValuesTest, HalfOfAWantIsNoValue) {
    EXPECT_THAT(values.on_heard(heard(0ms, "03 0066 0001", "03 02 0003")), IsEmpty());
    EXPECT_FALSE(values.readings()[1].sampled);
}

TEST_F(HeardValuesTest, AConfirmedWriteIsAValueToo) {
    values.on_heard(heard(0ms, "06 0064 0007", "06 0064 0007"));
    EXPECT_THAT(values.readings()[0].values, ElementsAre(7));
    values.on_heard(heard(1ms, "10 0066 0002 04 0008 0009", "10 0066 0002"));
    EXPECT_THAT(values.readings()[1].values, ElementsAre(8, 9));
    values.on_heard(heard(2ms, "05 0007 FF00", "05 0007 FF00"));
    EXPECT_THAT(values.readings()[2].values, ElementsAre(1));
    values.on_heard(heard(3ms, "0F 0006 0003 01 05", "0F 0006 0003"));
    EXPECT_THAT(values.readings()[2].values, ElementsAre(0));
    EXPECT_EQ(quality(2, 10ms), Quality::good);
}

TEST_F(HeardValuesTest, AWriteThatNobodyConfirmsMakesTheValueOld) {
    values.on_heard(heard(0ms, "03 0064 0001", "03 02 0001"));
    EXPECT_THAT(values.on_heard(heard(100ms, "06 0064 0007", "")), testing::Contains(0));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
    EXPECT_THAT(values.readings()[0].values, ElementsAre(1));
    values.on_heard(heard(300ms, "03 0064 0001", "03 02 0007"));
    EXPECT_EQ(quality(0, 400ms), Quality::good);
    values.on_heard(heard(500ms, "06 0064 0009", "86 02"));  // refused: nothing was written
    EXPECT_EQ(quality(0, 600ms), Quality::good);
}

TEST_F(HeardValuesTest, ABroadcastMakesValuesOld) {
    values.on_heard(heard(0ms, "03 0064 0001", "03 02 0001"));
    tap::Transaction all = heard(100ms, "06 0064 0007", "");
    all.station = 0;
    all.end = tap::End::unasked;
    values.on_heard(all);
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
}

TEST_F(HeardValuesTest, WhatIsInDoubtIsNoValue) {
    tap::Transaction read = heard(0ms, "03 0064 0001", "03 02 0001");
    read.doubtful = true;
    EXPECT_THAT(values.on_heard(read), IsEmpty());
    values.on_heard(heard(0ms, "03 0064 0001", "03 02 0001"));
    tap::Transaction write = heard(100ms, "06 0064 0007", "06 0064 0007");
    write.doubtful = true;
    values.on_heard(write);
    EXPECT_THAT(values.readings()[0].values, ElementsAre(1));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
}

TEST_F(HeardValuesTest, AReadThatFailsMakesItsWantsStale) {
    values.on_heard(heard(0ms, "03 0064 0001", "03 02 0001"));
    EXPECT_THAT(values.on_heard(heard(100ms, "03 0064 0001", "")), ElementsAre(0));
    EXPECT_EQ(quality(0, 200ms), Quality::stale);
    values.on_heard(heard(300ms, "03 0064 0001", "83 02"));
    EXPECT_EQ(values.readings()[0].exception, 2);
}

TEST_F(HeardValuesTest, ReadAndWriteInOneReadsBehindItsWrite) {
    values.on_heard(heard(0ms, "17 0064 0004 0064 0001 02 00FF", "17 08 00FF 0002 0003 0004"));
    EXPECT_THAT(values.readings()[0].values, ElementsAre(0xFF));
    EXPECT_EQ(quality(0, 100ms), Quality::good);
}

TEST_F(HeardValuesTest, WhatContradictsItselfChangesNothing) {
    EXPECT_THAT(values.on_heard(heard(0ms, "10 0066 0002 02 0008", "10 0066 0002")), IsEmpty());
    EXPECT_THAT(values.on_heard(heard(0ms, "41 01", "41 02")), IsEmpty());
    tap::Transaction nothing = heard(0ms, "03", "03");
    EXPECT_THAT(values.on_heard(nothing), IsEmpty());
}

}  // namespace
}  // namespace panelgate::points::heard_values_test
