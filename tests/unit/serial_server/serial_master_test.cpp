#include "panelgate/serial_server/serial_master.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::serial_master_test {
namespace {

using modbus::encode_adu;
using panelgate::test::FakeBus;
using panelgate::test::ManualClock;
using panelgate::test::MemoryLine;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

Settings with_access(Settings settings) {
    settings.access.lines = {"floor1"};
    settings.access.units = {{kOurs, {"floor1", 3}}};
    settings.access.broadcast = tcp_server::BroadcastMode::silent;
    return settings;
}

/// A master's port with one bus behind it.
struct House {
    explicit House(Settings given = Talk::rtu())
        : settings(with_access(std::move(given))),
          wire(new MemoryLine(clock)),
          master(clock, settings,
                 tcp_server::UnitMap(settings.access, {{"floor1", &bus, {5}, false}}),
                 std::unique_ptr<line::Line>(wire)) {
        bus.script = [](const bus::Request&) { return std::nullopt; };
        master.start();
    }

    void hear(const Bytes& bytes) {
        wire->come(bytes);
        wire->poll_input();
    }
    void answer(const bus::Answer& answer) {
        bus.release(answer);
        run();
    }
    void run() {
        io.restart();
        io.poll();
        clock.advance(100ms);
    }
    /// Returns what the master has received since the last call.
    std::vector<Bytes> told() { return std::exchange(wire->written, {}); }
    std::vector<Bytes> told(Fault fault) {
        hear(kRequest);
        answer(FakeBus::fault(fault, true));
        return told();
    }

    boost::asio::io_context io;
    ManualClock clock;
    FakeBus bus{io.get_executor()};
    Settings settings;
    MemoryLine* wire;
    SerialMaster master;
};

TEST(SerialMaster, AsksTheStationBehindTheUnitUnderItsName) {
    House house;
    house.hear(encode_adu(6, kReadOne));
    EXPECT_THAT(house.bus.requests, IsEmpty()) << "an unlisted unit";
    house.hear(kRequest);
    ASSERT_THAT(house.bus.requests, SizeIs(1));
    EXPECT_EQ(house.bus.requests[0].station, 3);
    EXPECT_EQ(house.bus.names.at(house.bus.requests[0].client), "serial plc");
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_THAT(house.told(), ElementsAre(kReply));
    house.hear(encode_adu(5, kReadOne));
    EXPECT_THAT(house.bus.requests, SizeIs(2)) << "a configured station";
    house.answer(FakeBus::reply({0x83, 0x06}));
    EXPECT_THAT(house.told(), ElementsAre(encode_adu(5, Bytes{0x83, 0x06}))) << "it refuses";
    EXPECT_EQ(house.master.counters().exceptions, 1u);
}

TEST(SerialMaster, HearsTheMasterBeforeItAnswersLate) {
    House house;
    house.hear(kRequest);
    house.clock.advance(300ms);
    house.wire->come(encode_adu(5, kReadOne));  // not processed yet
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_THAT(house.told(), IsEmpty());
    EXPECT_THAT(house.bus.cancelled, ElementsAre(house.bus.requests[0].client));
}

TEST(SerialMaster, IsSilentWhereTheGatewayHasNoAnswerOrReturnsTheException) {
    House house;
    for (const Fault fault : {Fault::busy, Fault::expired, Fault::not_routed, Fault::line_down,
                              Fault::line_lost, Fault::timeout, Fault::damaged, Fault::offline})
        EXPECT_THAT(house.told(fault), IsEmpty());
    EXPECT_EQ(house.master.counters().silent, 8u);
    Settings settings = Talk::rtu();
    settings.on_failure = OnFailure::exception;
    House other(settings);
    const auto exception = [](std::uint8_t code) { return encode_adu(kOurs, Bytes{0x83, code}); };
    EXPECT_THAT(other.told(Fault::busy), ElementsAre(exception(0x06)));
    EXPECT_THAT(other.told(Fault::line_down), ElementsAre(exception(0x0A)));
    EXPECT_THAT(other.told(Fault::timeout), ElementsAre(exception(0x0B)));
}

TEST(SerialMaster, RefusesWritesWhereOnlyReadsAreAllowed) {
    Settings settings = Talk::rtu();
    settings.access.read_only = true;
    House house(settings);
    house.hear(encode_adu(kOurs, kWrite));
    house.run();
    EXPECT_THAT(house.told(), ElementsAre(encode_adu(kOurs, Bytes{0x86, 0x01})));
    EXPECT_EQ(house.bus.told_refused, 1);
    house.hear(encode_adu(0, kWrite));
    EXPECT_THAT(house.bus.requests, IsEmpty());
}

TEST(SerialMaster, ServesOtherUnitsWithoutOpeningItsPortAnewAndAnswersWhatWasAsked) {
    House house;
    house.hear(kRequest);
    Settings now = house.settings;
    now.access.units = {{7, {"floor1", 5}}};
    ASSERT_TRUE(now.is_same_port(house.settings));
    house.master.apply(now, tcp_server::UnitMap(now.access, {{"floor1", &house.bus, {5}, false}}));
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_THAT(house.told(), ElementsAre(kReply)) << "asked before";
    house.hear(kRequest);
    house.run();
    EXPECT_THAT(house.bus.requests, SizeIs(1)) << "no unit of ours any more";
    house.hear(encode_adu(7, kReadOne));
    house.run();
    ASSERT_THAT(house.bus.requests, SizeIs(2));
    EXPECT_EQ(house.bus.requests.back().station, 5);
    EXPECT_EQ(house.master.counters().reopens, 0U);
}

TEST(SerialMaster, SendsBroadcastsThatALaterRequestDoesNotTakeBack) {
    House house;
    house.hear(encode_adu(0, kWrite));
    house.hear(kRequest);
    house.hear(encode_adu(5, kReadOne));
    ASSERT_THAT(house.bus.requests, SizeIs(3));
    EXPECT_EQ(house.bus.requests[0].station, 0);
    EXPECT_THAT(house.bus.cancelled, ElementsAre(house.bus.requests[1].client));
    EXPECT_NE(house.bus.requests[0].client, house.bus.requests[1].client);
}

TEST(SerialMaster, KeepsAFewBroadcastsOpen) {
    House house;
    for (int i = 0; i < 100; ++i) house.hear(encode_adu(0, kWrite));
    EXPECT_THAT(house.bus.requests, SizeIs(house.settings.open_broadcasts));
    house.answer(FakeBus::reply(kWrite));
    EXPECT_TRUE(house.master.idle());
    house.hear(encode_adu(0, kWrite));
    EXPECT_THAT(house.bus.requests, SizeIs(house.settings.open_broadcasts + 1));
}

TEST(SerialMaster, AnswersWhatItTookBeforeItEndsAndTakesItBackWhenItStops) {
    House house;
    house.hear(kRequest);
    house.master.finish();
    EXPECT_FALSE(house.master.idle());
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_THAT(house.told(), SizeIs(1));
    EXPECT_TRUE(house.master.idle());
    House other;
    other.hear(kRequest);
    other.master.stop();
    EXPECT_THAT(other.bus.cancelled, ElementsAre(other.bus.requests[0].client));
    other.run();
    EXPECT_THAT(other.told(), IsEmpty());
}

TEST(SerialMaster, OutlivesAPortThatGoesWhileItReplies) {
    House house;
    house.wire->fail_writes = true;
    house.hear(kRequest);
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_FALSE(house.master.counters().up);
    house.wire->fail_writes = false;
    house.told();
    house.wire->events()->on_up();
    house.hear(kRequest);
    house.answer(FakeBus::reply(kOneValue));
    EXPECT_THAT(house.told(), SizeIs(1));
}

}  // namespace
}  // namespace panelgate::serial_server::test::serial_master_test
