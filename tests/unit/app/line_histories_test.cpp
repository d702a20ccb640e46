#include "scene.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "panelgate/bus/bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::app::line_histories_test {
namespace {

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
}  // namespace panelgate::app::line_histories_test
