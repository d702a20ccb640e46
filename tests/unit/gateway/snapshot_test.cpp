// What others see of the plant: REST, metrics, events, and the histories of its lines.
#include "panelgate/gateway/snapshot.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::gateway::snapshot_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// press 31 has one point and one poll block; meter 5 is read-only.
class SnapshotTest : public testing::Test {
  protected:
    SnapshotTest() {
        panel.name = "test-panel";
        floor.name = "floor1";
        floor.device.device = "/dev/ttyUSB0";
        floor.stations.resize(2);
        config::Station& press = floor.stations[0];
        press.id = 31;
        press.name = "press";
        press.points.resize(1);
        press.points[0].name = "temperature";
        press.points[0].unit = "celsius";
        press.polls.resize(1);
        press.polls[0].address = 300;
        config::Station& meter = floor.stations[1];
        meter.id = 5;
        meter.name = "meter";
        meter.read_only = true;
        press.profile = meter.profile = &panel;
        plant.add(floor, bus, nullptr);
        polls = std::make_unique<points::StationPolls>(
            points::wants_of(press.points, press.polls),
            points::make_plan_limits(panel, SerialFormat{}, 2ms), now);
        plant.at("floor1", 31).points.emplace(press.points, press.polls, *polls);
    }
    /// Simulates a poll that reads the point's value.
    void poll() {
        while (points::quality_of(polls->reading(0), 1s, now) != points::Quality::good) {
            now = std::max(now, *polls->next_due());
            while (const auto due = polls->take_due(now)) {
                Bytes reply = Writer().u8(3).u8(2).u16(215).take();
                polls->on_answer(now, due->read, Result<Bytes>(std::move(reply)), now);
            }
        }
    }

    boost::asio::io_context io;
    test::FakeBus bus{io.get_executor()};
    profile::PanelProfile panel;
    config::Line floor;
    Plant plant;
    TimePoint now{1h};
    std::unique_ptr<points::StationPolls> polls;
    web::EventOutlet events{std::make_shared<web::EventHub>(), {}};
    web::EventHub& hub = *events.hub();
    profile::PanelProfile generic;
};

TEST_F(SnapshotTest, RestSeesTheStationsOfThePlantAndPanelsOfAnyKind) {
    const web::Directory directory = directory_of(plant, generic);
    ASSERT_EQ(directory.lines.size(), 1u);
    EXPECT_EQ(directory.find_line("floor1")->device, "/dev/ttyUSB0");
    ASSERT_EQ(directory.stations.size(), 2u);
    const auto press = directory.find_station("floor1:31");
    ASSERT_TRUE(press);
    EXPECT_EQ(press->name, "press");
    EXPECT_EQ(press->bus, &bus);
    EXPECT_EQ(press->profile, &panel);
    EXPECT_FALSE(press->unknown_panel);
    EXPECT_FALSE(press->read_only);
    EXPECT_EQ(press->points, &*plant.find("press")->points);
    EXPECT_EQ(press->simulated, nullptr);
    EXPECT_TRUE(directory.find_station("meter")->read_only);
    EXPECT_EQ(directory.find_station("meter")->points, nullptr);
    const auto stranger = directory.find_station("floor1:9");
    ASSERT_TRUE(stranger) << "nobody has listed it";
    EXPECT_EQ(stranger->profile, &generic);
    EXPECT_TRUE(stranger->unknown_panel);
    floor.refuse_unlisted = true;
    EXPECT_FALSE(directory_of(plant, generic).find_station("floor1:9"));
}

TEST_F(SnapshotTest, P10AScrapeHasEveryPointButNoValueThatWasNeverRead) {
    auto samples = samples_of(seen_points(plant, now));
    ASSERT_EQ(samples.size(), 1u);
    EXPECT_EQ(samples[0].line, "floor1");
    EXPECT_EQ(samples[0].station, "press");
    EXPECT_EQ(samples[0].point, "temperature");
    EXPECT_EQ(samples[0].unit, "celsius");
    EXPECT_FALSE(samples[0].value);
    EXPECT_FALSE(samples[0].age);
    poll();
    samples = samples_of(seen_points(plant, now + 1s));
    EXPECT_EQ(samples[0].value, 215);
    EXPECT_EQ(samples[0].age, 1);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(SnapshotTest, TellsOfStationsByTheirNames) {
    const auto listener = hub.listen({});
    for (const std::uint8_t id : Bytes{31, 9}) {
        arbiter::StationEvent event;
        event.kind = arbiter::StationEvent::Kind::offline;
        event.station = id;
        publish(events, plant, "floor1", event);
    }
    const std::string told = listener->take();
    EXPECT_THAT(told, HasSubstr(R"("station":"press")"));
    EXPECT_THAT(told, HasSubstr(R"("station":"9")"));
}

TEST_F(SnapshotTest, TellsEachEventOnlyToThoseWhoWantWhatItIsAbout) {
    web::EventFilter press;
    press.stations = {{"floor1", "press"}};
    web::EventFilter temperature;
    temperature.points = {{"press", "temperature"}};
    web::EventFilter elsewhere;
    elsewhere.lines = {"floor2"};
    const auto of_press = hub.listen(press);
    const auto of_point = hub.listen(temperature);
    const auto of_line = hub.listen(elsewhere);
    for (const auto& listener : {of_press, of_point, of_line}) listener->take();
    poll();
    publish_points(events, plant.at("floor1", 31), {0}, now);
    publish(events, plant, "floor1", bus::TransactionEvent{31, 3, Outcome::ok, 5ms});
    publish(events, plant, "floor1", bus::TransactionEvent{5, 3, Outcome::ok, 5ms});
    publish(events, plant, "floor1", bus::LineEvent{true, {}});
    EXPECT_THAT(of_press->take(), AllOf(HasSubstr("event: point"), HasSubstr("event: transaction"),
                                        Not(HasSubstr("meter")), Not(HasSubstr("event: line"))));
    EXPECT_THAT(of_point->take(), AllOf(HasSubstr("event: point"), Not(HasSubstr("transaction"))));
    EXPECT_EQ(of_line->take(), "");
}

TEST_F(SnapshotTest, TellsWhatHasBecomeOfPointsAndNotOfPollBlocks) {
    const auto listener = hub.listen({});
    listener->take();
    poll();
    publish_points(events, plant.at("floor1", 31), {1}, now);
    EXPECT_EQ(listener->take(), "");
    publish_points(events, plant.at("floor1", 31), {0, 1}, now);
    const std::string told = listener->take();
    EXPECT_THAT(told, HasSubstr(R"("name":"temperature")"));
    EXPECT_THAT(told, HasSubstr(R"("line":"floor1","station":"press")"));
    EXPECT_EQ(told.find("id: 2"), std::string::npos);
}

/// A line that counts how often it is sampled.
class CountedLine final : public bus::LineBus {
  public:
    void start() override {}
    void stop() override {}
    void apply(bus::Settings, std::unique_ptr<line::Line>, std::shared_ptr<void>) override {}
    bus::LineReport report() const override {
        ++looks;
        bus::LineReport report;
        report.up = true;
        return report;
    }
    void transact(bus::Request, bus::AnswerHandler) override {}
    void cancel(bus::ClientId) override {}
    bus::LineStatus status() const override { return {}; }
    bus::StationStatus station_status(std::uint8_t) const override { return {}; }
    bus::TracePart trace(std::size_t) const override { return {}; }

    mutable int looks = 0;
};

TEST(LineHistories, LooksAtEachLineOnceASlotAndAtOneAtATime) {
    test::ManualClock clock;
    std::vector<CountedLine> lines(5);
    std::vector<const bus::LineBus*> all;
    for (const CountedLine& line : lines) all.push_back(&line);
    LineHistories histories(clock, all);
    histories.start();
    const auto looks = [&] {
        int sum = 0;
        for (const CountedLine& line : lines) sum += line.looks;
        return sum;
    };
    EXPECT_EQ(looks(), 1);
    for (int i = 2; i <= 50; ++i) {
        clock.advance(1s);
        EXPECT_EQ(looks(), i);
    }
    for (const CountedLine& line : lines) EXPECT_EQ(line.looks, 10);
    EXPECT_EQ(histories.at(0)->samples(clock.now()).size(), 9u);
    histories.stop();
    clock.advance(60s);
    EXPECT_EQ(looks(), 50);
}

TEST(LineHistories, OfManyLinesHaveWiderSlots) {
    test::ManualClock clock;
    CountedLine line;
    LineHistories few(clock, std::vector<const bus::LineBus*>(100, &line));
    EXPECT_EQ(few.at(0)->width(), 5s);
    LineHistories many(clock, std::vector<const bus::LineBus*>(300, &line));
    EXPECT_EQ(many.at(299)->width(), 20s);
    LineHistories(clock, {}).start();
}

}  // namespace
}  // namespace panelgate::gateway::snapshot_test
