#include "panelgate/points/station_points.hpp"

#include <gtest/gtest.h>

namespace panelgate::points::station_points_test {
namespace {

TEST(StationPoints, ShowsValuesWithQualityAndAge) {
    std::vector<Point> points(2);
    points[0].name = "temperature";
    points[0].address = 100;
    points[0].type = Type::i16;
    points[0].scale = 0.1;
    points[1].name = "state";
    points[1].address = 101;
    points[1].labels = {{1, "running"}};
    points[1].no_value = {0xFFFF};
    Poll poll;
    poll.address = 300;
    poll.count = 8;
    const std::vector<Poll> blocks{poll};
    const auto wants = wants_of(points, blocks);
    ASSERT_EQ(wants.size(), 3u);
    EXPECT_EQ(wants[2].span.count, 8u);

    const TimePoint start{1h};
    StationPolls polls(wants, make_plan_limits(profile::PanelProfile(), SerialFormat{}, 2ms),
                       start);
    const StationPoints station(points, blocks, polls);
    const Point& temperature = *station.find("temperature");
    EXPECT_EQ(station.read(temperature, start).quality, Quality::bad);
    EXPECT_FALSE(station.read(temperature, start).age);
    EXPECT_EQ(station.find("pressure"), nullptr);

    TimePoint now = start;
    const auto poll_once = [&](std::uint16_t state) {
        for (int i = 0; i < 2; ++i) {
            now = std::max(now, *polls.next_due());
            for (const auto& due : polls.take_due(now)) {
                Bytes reply = due.request.pdu()[2] == 100
                                  ? Writer().u8(3).u8(4).u16(215).u16(state).take()
                                  : Writer().u8(3).u8(16).raw(Bytes(16)).take();
                polls.on_answer(now, due.read, Result<Bytes>(std::move(reply)), now);
            }
        }
    };
    poll_once(1);
    const PointReading reading = station.read(temperature, now + 500ms);
    EXPECT_EQ(reading.quality, Quality::good);
    EXPECT_EQ(*reading.value, Value(21.5));
    EXPECT_GE(*reading.age, Duration(500ms));
    EXPECT_EQ(station.read(*station.find("state"), now).label, "running");
    EXPECT_EQ(station.reading(blocks[0]).good, 1u);
    EXPECT_EQ(station.reading(blocks[0]).values.size(), 8u);
    EXPECT_EQ(station.read(temperature, now + 5s).quality, Quality::stale);
    EXPECT_TRUE(station.read(temperature, now + 5s).value) << "shown with its age";
    EXPECT_FALSE(station.read(temperature, now + 60s).value) << "P10: never old as new";
    poll_once(0xFFFF);
    poll_once(0xFFFF);
    EXPECT_EQ(station.read(*station.find("state"), now).quality, Quality::bad) << "means no value";
}

}  // namespace
}  // namespace panelgate::points::station_points_test
