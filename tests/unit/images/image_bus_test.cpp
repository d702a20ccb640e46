#include "panelgate/images/image_bus.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>

#include "panelgate/modbus/response.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::images {
namespace {

using bus::Answer;
using modbus::Table;
using test::FakeBus;

/// Two stations of one bus with a register each, polled just now.
class ImageBusTest : public testing::Test {
  protected:
    ImageBusTest() {
        for (const char* name : {"x", "y"}) {
            points::Point point;
            point.name = name;
            point.writable = true;
            point.address = 5;
            points.push_back(point);
        }
        points[1].address = 6;
        points[1].max = Decimal(100);
        readings.resize(2);
        for (std::size_t i = 0; i < 2; ++i) {
            readings[i].values = {static_cast<std::uint16_t>(10 + i)};
            readings[i].sampled = clock.now();
        }
        lines.script = [](const bus::Request& request) {
            return FakeBus::reply(modbus::normal_write_reply(request.request.pdu()));
        };
        show();
    }

    void show() {
        auto content = std::make_shared<Content>();
        content->settings.unit = 100;
        content->settings.entries = {{"s", "x"}, {"s", "y"}};
        content->layout = {content->settings, [this](std::string_view, std::string_view name) {
                               return name == "x" ? &points[0] : &points[1];
                           }};
        content->sources = {{&lines, 7, &profile, &station, 2s},
                            {&lines, 8, &profile, &station, 2s}};
        image.show(content);
    }

    Answer ask(const Bytes& pdu) {
        std::optional<Answer> got;
        image.transact({.station = 100,
                        .request = *modbus::Request::make(pdu, modbus::QuantityCheck::fit),
                        .client = 3},
                       [&](Answer answer) { got = std::move(answer); });
        EXPECT_FALSE(got) << "answered inside the call";
        context.restart();
        context.run();
        return got.value_or(Answer{});
    }

    boost::asio::io_context context;
    test::ManualClock clock;
    FakeBus lines{context.get_executor()};
    profile::PanelProfile profile = *profile::Catalogue::shipped().find("generic");
    std::vector<points::Point> points;
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings;
    points::StationPoints station{points, blocks, readings};
    int refused = 0;
    ImageBus image{context.get_executor(), clock,
                   [this](const WhoRef&, std::uint8_t unit, ByteView) {
                       EXPECT_EQ(unit, 100);
                       ++refused;
                   }};
};

TEST_F(ImageBusTest, AReadAsksNoLine) {
    EXPECT_EQ(*ask({3, 0, 0, 0, 2}).pdu, (Bytes{3, 4, 0, 10, 0, 11}));
    EXPECT_EQ(*ask({4, 0, 1, 0, 1}).pdu, (Bytes{4, 2, 0, 11}));
    EXPECT_EQ(*ask({3, 0, 1, 0, 2}).pdu, (Bytes{0x83, 2}));
    EXPECT_TRUE(lines.requests.empty());
}

TEST_F(ImageBusTest, AValueThatIsNotGoodIsNoValue) {
    readings[1].failing = true;
    EXPECT_EQ(ask({3, 0, 0, 0, 2}).pdu.error(), Fault::offline);
    EXPECT_EQ(*ask({3, 0, 0, 0, 1}).pdu, (Bytes{3, 2, 0, 10}));
}

TEST_F(ImageBusTest, OneWriteOfTwoPointsIsTwoWritesInTurn) {
    const Answer answer = ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2});
    EXPECT_EQ(*answer.pdu, (Bytes{16, 0, 0, 0, 2}));
    EXPECT_TRUE(answer.transmitted);
    ASSERT_EQ(lines.requests.size(), 2U);
    EXPECT_EQ(lines.requests[0].station, 7);
    EXPECT_EQ(lines.requests[0].request.pdu(), (Bytes{6, 0, 5, 0, 1}));
    EXPECT_EQ(lines.requests[1].station, 8);
    EXPECT_EQ(lines.requests[1].client, 3U);
}

TEST_F(ImageBusTest, AWriteThatCannotBeDoneWritesNothing) {
    EXPECT_EQ(*ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 101}).pdu, (Bytes{0x90, 3})) << "above y's max";
    points[1].writable = false;
    EXPECT_EQ(*ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2}).pdu, (Bytes{0x90, 2}));
    EXPECT_EQ(ask({22, 0, 0, 0, 1, 0, 1}).pdu.error(), Fault::denied);
    EXPECT_TRUE(lines.requests.empty());
    EXPECT_EQ(refused, 3) << "each is told";
}

TEST_F(ImageBusTest, TheFirstFailureEndsAWrite) {
    lines.script = [](const bus::Request& request) {
        return request.station == 7 ? FakeBus::reply({0x86, 4}) : FakeBus::reply({6, 0, 6, 0, 2});
    };
    EXPECT_EQ(*ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2}).pdu, (Bytes{0x90, 4}));
    EXPECT_EQ(lines.requests.size(), 1U);
    lines.script = [](const bus::Request&) { return FakeBus::fault(Fault::timeout, true); };
    EXPECT_EQ(ask({6, 0, 0, 0, 1}).pdu.error(), Fault::timeout);
}

TEST_F(ImageBusTest, TheDeadlineIsThatOfTheWholeWrite) {
    Duration needs = 500ms;
    lines.script = [&](const bus::Request& request) {
        clock.advance(needs);
        return FakeBus::reply(modbus::normal_write_reply(request.request.pdu()));
    };
    EXPECT_TRUE(ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2}).pdu.has_value());
    ASSERT_EQ(lines.requests.size(), 2U);
    EXPECT_EQ(lines.requests[0].within, 2s);
    EXPECT_EQ(lines.requests[1].within, 1500ms) << "of which the first point took some";
    needs = 2s;
    const Answer late = ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2});
    EXPECT_EQ(late.pdu.error(), Fault::timeout);
    EXPECT_TRUE(late.transmitted);
    EXPECT_EQ(lines.requests.size(), 3U);
}

TEST_F(ImageBusTest, AClientThatHasGoneWritesNoFurtherPoint) {
    lines.script = [this](const bus::Request& request) {
        image.cancel(3);
        return FakeBus::reply(modbus::normal_write_reply(request.request.pdu()));
    };
    EXPECT_EQ(ask({16, 0, 0, 0, 2, 4, 0, 1, 0, 2}).pdu.error(), Fault::cancelled);
    EXPECT_EQ(lines.requests.size(), 1U);
}

TEST_F(ImageBusTest, AReadOnlyStationIsNotWritten) {
    lines.rights = bus::Rights({{7, {.name = "s", .access = bus::Access::read_only}}});
    const Answer answer = ask({6, 0, 0, 0, 1});
    EXPECT_EQ(*answer.pdu, (Bytes{0x86, 1}));
    EXPECT_TRUE(lines.requests.empty());
}

TEST_F(ImageBusTest, AnImageThatIsNoMoreLeadsNowhere) {
    image.show(nullptr);
    EXPECT_EQ(ask({3, 0, 0, 0, 1}).pdu.error(), Fault::not_routed);
}

}  // namespace
}  // namespace panelgate::images
