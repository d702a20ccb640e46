#include "connection.hpp"

#include <gmock/gmock.h>

namespace panelgate::mqtt::open_messages_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

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
}  // namespace panelgate::mqtt::open_messages_test
