#include <string>

#include "http_rig.hpp"

namespace panelgate::web::plan_test {
namespace {

using Plan = HttpRig;

TEST_F(Plan, ShowsTheFrameOfAReadAndTheNotationOfEachItem) {
    const Reply plan = get("/api/v1/stations/press/devices/UW100/plan?count=3");
    EXPECT_EQ(plan.status(), 200u);
    EXPECT_EQ(plan.at("frame"), "1F 03 00 64 00 03 47 AA");
    EXPECT_EQ(plan.at("table"), "holding-registers");
    EXPECT_EQ(plan.at("address"), 100);
    EXPECT_EQ(plan.at("notations"), json_of(R"(["UW100","UW101","UW102"])"));
    EXPECT_EQ(plan.at("requests"), 1);
    EXPECT_TRUE(bus.requests.empty()) << "nothing goes out";
}

TEST_F(Plan, OfATableSaysTheSame) {
    const Reply plan = get("/api/v1/stations/press/holding-registers/100/plan?count=3");
    EXPECT_EQ(plan.at("frame"), "1F 03 00 64 00 03 47 AA");
    EXPECT_EQ(plan.at("notations"), json_of(R"(["UW100","UW101","UW102"])"));
}

TEST_F(Plan, OfALongReadIsThatOfItsFirstRequest) {
    const Reply plan = get("/api/v1/stations/press/devices/UW0/plan?count=70");
    EXPECT_EQ(plan.at("requests"), 3);
    EXPECT_EQ(plan.at("count"), 32);
}

TEST_F(Plan, OfAWriteHasItsValues) {
    const Reply one = get("/api/v1/stations/press/devices/UW100/plan?values=5");
    EXPECT_EQ(one.at("frame").as_string().subview(0, 17), "1F 06 00 64 00 05");
    const Reply two = get("/api/v1/stations/press/devices/UW100/plan?values=5,6");
    EXPECT_EQ(two.at("frame").as_string().subview(0, 32), "1F 10 00 64 00 02 04 00 05 00 06");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(Plan, GoesOutInTheFunctionThatThePanelHas) {
    panel.functions.erase(panel.functions.begin() + 3);  // 06
    const Reply plan = get("/api/v1/stations/press/holding-registers/1/plan?values=5");
    EXPECT_EQ(plan.at("frame").as_string().subview(0, 26), "1F 10 00 01 00 01 02 00 05");
}

TEST_F(Plan, TellsWhyThereIsNone) {
    EXPECT_EQ(get("/api/v1/stations/press/devices/XY1/plan").status(), 404u);
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW998/plan?count=5").status(), 422u);
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW500/plan?values=1").status(), 422u);
    EXPECT_EQ(get("/api/v1/stations/press/devices/TM1/plan?values=1").status(), 405u);
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW1/plan?values=x").status(), 400u);
    EXPECT_EQ(get("/api/v1/stations/press/devices/UW1/plan?values=99999").status(), 400u);
    EXPECT_EQ(get("/api/v1/stations/none/coils/1/plan").status(), 404u);
}

TEST_F(Plan, OfAnUnknownPanelHasNoNotations) {
    add_meter();
    const Reply plan = get("/api/v1/stations/meter/coils/7/plan?count=2");
    EXPECT_EQ(plan.at("notations"), json_of("[]"));
    EXPECT_EQ(plan.at("frame").as_string().subview(0, 17), "05 01 00 07 00 02");
}

}  // namespace
}  // namespace panelgate::web::plan_test
