#include "panelgate/rt/process.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace panelgate::rt::descriptors_test {
namespace {

using Numbers = std::vector<std::size_t>;

TEST(Descriptors, AreGivenAsAskedForWhileThereAreEnough) {
    EXPECT_EQ(share_descriptors(1280, {1024, 256}), (Numbers{1024, 256}));
    EXPECT_EQ(share_descriptors(0, {}), Numbers{});
    EXPECT_EQ(share_descriptors(0, {0}), Numbers{0});
}

TEST(Descriptors, AreSharedInProportionWhenThereAreFewer) {
    EXPECT_EQ(share_descriptors(640, {1024, 256}), (Numbers{512, 128}));
    EXPECT_EQ(share_descriptors(952, {1024, 256}), (Numbers{761, 190}));
}

TEST(Descriptors, EachShareIsAtLeastOne) {
    EXPECT_EQ(share_descriptors(10, {100000, 1}), (Numbers{9, 1}));
    EXPECT_EQ(share_descriptors(0, {1024, 256}), (Numbers{1, 1}));
}

class DescriptorLimit : public testing::Test {
  protected:
    void SetUp() override { ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0); }
    void TearDown() override { ::setrlimit(RLIMIT_NOFILE, &before); }
    rlimit before{};
};

TEST_F(DescriptorLimit, IsRaisedAsFarAsItMayBe) {
    const rlimit low{32, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
    EXPECT_EQ(raise_descriptor_limit(), before.rlim_max);
    rlimit now{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &now), 0);
    EXPECT_EQ(now.rlim_cur, before.rlim_max);
}

}  // namespace
}  // namespace panelgate::rt::descriptors_test
