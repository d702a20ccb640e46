#include "panelgate/plan/advice.hpp"

#include <gmock/gmock.h>

#include "plant_line.hpp"

namespace panelgate::plan {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

class AdviceTest : public testing::Test, protected test::PlantLine {
  protected:
    std::vector<Advice> advice() const { return advise(line, make_plan(line)); }
    /// The piece that begins like this; an empty one when there is none.
    Advice find(const std::string& start) const {
        for (const Advice& one : advice()) {
            if (one.what.starts_with(start)) return one;
        }
        return {};
    }
};

TEST_F(AdviceTest, ALineThatIsFineNeedsNone) {
    ask(add("press"), 0, 10, 1s);
    EXPECT_THAT(advice(), IsEmpty());
}

TEST_F(AdviceTest, TheLowestRateThatIsEnoughIsTold) {
    ask(add("press"), 0, 100, 200ms);
    const Advice rate = find("serial: {baud: 19200}");
    EXPECT_NEAR(rate.load, make_plan(at_rate(line, 19200)).load, 1e-12);
    EXPECT_LT(rate.load, kHigh);
}

TEST_F(AdviceTest, ARateThatAPanelDoesNotHaveIsNotTold) {
    ask(add("press"), 0, 100, 200ms);
    profile::PanelProfile slow = *shipped.find("generic");
    slow.serial.baud = {9600};
    add("old").profile = &slow;
    EXPECT_THAT(find("serial").what, IsEmpty());
}

TEST_F(AdviceTest, ADearPollIsToldByItsStationWithAnIntervalThatIsEnough) {
    ask(add("press"), 0, 100, 250ms);
    ask(add("mixer"), 0, 1, 1s);
    const Advice slower = find("read press R0 (100) every ");
    EXPECT_THAT(slower.what, HasSubstr("every 300ms instead of 250ms"));
    EXPECT_LE(slower.load, kHigh);
    EXPECT_GT(slower.load, 0.7);
}

TEST_F(AdviceTest, WhereNoPollAloneIsEnoughAllIntervalsAre) {
    for (const char* name : {"a", "b", "c", "d"}) ask(add(name), 0, 100, 600ms);
    EXPECT_THAT(find("read").what, IsEmpty());
    const Advice all = find("all intervals ");
    EXPECT_LE(all.load, kHigh);
    EXPECT_GT(all.load, 0.7);
}

TEST_F(AdviceTest, RelaysThatGoOnWhereAnotherEndsCouldBeOne) {
    add("from");
    add("to");
    for (const std::uint32_t first : {4u, 0u, 8u}) copy(first, 4, 200ms);
    const Advice one = find("one relay instead of ");
    EXPECT_THAT(one.what, HasSubstr("copy4 and copy8"));
    EXPECT_THAT(one.what, HasSubstr("copy0 and copy4"));
    line.relays.clear();
    copy(0, 12, 200ms);
    EXPECT_NEAR(one.load, make_plan(line).load, 1e-9);
}

TEST_F(AdviceTest, RelaysThatDifferStayTwo) {
    add("from");
    add("to");
    copy(0, 4, 150ms);
    copy(4, 4, 150ms).to->span.first += 1;
    EXPECT_THAT(find("one relay").what, IsEmpty());
    line.relays[1].to->span.first -= 1;
    EXPECT_THAT(find("one relay").what, Not(IsEmpty()));
    line.relays[1].writes_every = 60s;
    EXPECT_THAT(find("one relay").what, IsEmpty());
}

TEST_F(AdviceTest, RelaysThatNoWriteHoldsTogetherStayTwo) {
    add("from");
    add("to");
    copy(0, 100, 300ms);
    copy(100, 24, 300ms);
    EXPECT_THAT(find("one relay").what, IsEmpty());
}

TEST_F(AdviceTest, NothingIsToldThatBringsNothing) {
    line.serial.baud = 115200;
    ask(add("press"), 0, 100, 12ms);
    for (const Advice& one : advice()) EXPECT_LT(one.load, make_plan(line).load) << one.what;
    EXPECT_THAT(advice(), Not(IsEmpty()));
    EXPECT_THAT(find("serial").what, IsEmpty()) << "there is no higher one";
}

}  // namespace
}  // namespace panelgate::plan
