#include "panelgate/sim/simulated_bus.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::sim::simulated_bus_test {
namespace {

const Bytes kReadCounter = "03 00 00 00 01"_hex;

Settings settings_38400() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    return settings;
}

/// A master at the pty of simulated panels, with a manual clock.
class SimulatedBusTest : public testing::Test {
  protected:
    ~SimulatedBusTest() override {
        if (master >= 0) ::close(master);
    }
    void start(std::initializer_list<std::uint8_t> ids) {
        std::vector<Station> stations;
        for (const std::uint8_t id : ids) stations.emplace_back(*profiles.find("generic"), id);
        bus = std::make_unique<SimulatedBus>(context.get_executor(), clock, settings,
                                             std::move(stations));
        bus->start();
        master = ::open(bus->device().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
        ASSERT_GE(master, 0);
    }
    /// Sends a request; the panels receive its first byte now.
    void say(std::uint8_t station, ByteView pdu = kReadCounter) {
        const Bytes adu = modbus::encode_adu(station, pdu);
        ASSERT_EQ(::write(master, adu.data(), adu.size()), std::ssize(adu));
        context.restart();
        while (context.run_one() == 0) context.restart();
    }
    /// The kernel may hand over what was written in parts, but all of it before EAGAIN.
    Bytes heard() {
        Bytes bytes;
        std::array<std::uint8_t, 512> buffer;
        for (ssize_t n; (n = ::read(master, buffer.data(), buffer.size())) > 0;)
            bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + n);
        return bytes;
    }
    /// Station of the valid reply received; 0: none.
    int answered() {
        const Bytes adu = heard();
        return adu.size() >= modbus::kMinAdu && modbus::crc_ok(adu) ? adu[0] : 0;
    }
    /// The same, for a request to `station` and after the time of its reply.
    int answered(std::uint8_t station) {
        say(station);
        clock.advance(whole());
        return answered();
    }
    /// From the first bit of a request to the last of its reply.
    Duration whole() const {
        return wire_time(settings.serial, 8) + wire_time(settings.serial, 7) +
               silent_interval(settings.serial) + settings.think_time;
    }

    profile::Catalogue profiles = profile::Catalogue::shipped();
    Settings settings = settings_38400();
    boost::asio::io_context context;
    test::ManualClock clock;
    std::unique_ptr<SimulatedBus> bus;
    int master = -1;
};

TEST_F(SimulatedBusTest, AReplyIsWholeWhenItsLastBitHasLeft) {
    start({1});
    say(1);
    clock.advance(whole() - 10us);
    EXPECT_EQ(answered(), 0);
    say(1);  // over its last byte
    clock.advance(whole());
    EXPECT_EQ(answered(), 0);
    EXPECT_EQ(answered(1), 1);
}

TEST_F(SimulatedBusTest, APanelThatThinksForLongLeavesTheOthersAlone) {
    settings.faults[2].slow = 900ms;
    start({1, 2});
    say(2);
    clock.advance(50ms);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(answered(1), 1) << i;
    }
    clock.advance(1s);
    EXPECT_EQ(answered(), 2);
}

TEST_F(SimulatedBusTest, APanelHearsNothingWhileItThinks) {
    settings.faults[2].slow = 100ms;
    start({2});
    say(2);
    clock.advance(50ms);
    say(2);
    clock.advance(1s);
    EXPECT_EQ(heard().size(), 7U) << "one reply";
}

TEST_F(SimulatedBusTest, ALateReplyOverARequestDamagesBoth) {
    settings.faults[2].slow = 100ms;
    start({1, 2});
    say(2);
    clock.advance(100ms + wire_time(settings.serial, 8));
    say(1);  // the reply begins while this leaves
    clock.advance(1s);
    EXPECT_EQ(answered(), 0);
    EXPECT_EQ(answered(1), 1);
}

TEST_F(SimulatedBusTest, TwoPanelsThatSpeakAtOnceAreBothDamaged) {
    settings.faults[2].slow = 100ms;
    start({1, 2});
    say(2);
    const Duration before = wire_time(settings.serial, 8) + silent_interval(settings.serial);
    clock.advance(100ms - before + wire_time(settings.serial, 2));
    say(1);  // ends before the reply begins, and is answered two characters later
    clock.advance(1s);
    EXPECT_EQ(answered(), 0);
    EXPECT_EQ(answered(1), 1);
}

}  // namespace
}  // namespace panelgate::sim::simulated_bus_test
