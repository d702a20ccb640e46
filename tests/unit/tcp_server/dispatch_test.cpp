#include "panelgate/tcp_server/dispatch.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "held_bus.hpp"
#include "support/hex.hpp"

namespace panelgate::tcp_server::dispatch_test {
namespace {

const Bytes kRead = "03 00 00 00 01"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;
const Bytes kTooMuch = "03 00 00 00 7E"_hex;  // 126 registers

/// A listener with two lines: stations 1 and 2 on "a", 2 read-only; 3 on "b".
class DispatchTest : public ::testing::Test {
  protected:
    DispatchTest() { bus_a.protect(2); }
    /// Returns "to a/1", "to everybody on a, b", "itself", or the exception code as "refused 01".
    std::string decided(std::uint8_t unit, const Bytes& pdu) {
        const UnitMap units(settings, {{"a", &bus_a, {1, 2}, false}, {"b", &bus_b, {3}, false}});
        const Decision decision = decide(unit, pdu, settings, units);
        if (const auto* refuse = std::get_if<Refuse>(&decision))
            return "refused " + to_hex(Bytes{static_cast<std::uint8_t>(refuse->code)});
        if (const auto* forward = std::get_if<Forward>(&decision))
            return "to " + name_of(forward->target.bus) + '/' +
                   std::to_string(forward->target.station);
        if (std::holds_alternative<Diagnose>(decision)) return "itself";
        std::string text = "to everybody on";
        for (const bus::BusClient* line : std::get<Broadcast>(decision).lines)
            text += ' ' + name_of(line);
        return text;
    }
    std::string name_of(const bus::BusClient* line) const { return line == &bus_a ? "a" : "b"; }

    boost::asio::io_context context;
    ManualBus bus_a{context};
    ManualBus bus_b{context};
    Settings settings;
};

TEST_F(DispatchTest, ForwardsToTheStationThatTheUnitStandsFor) {
    settings.units[101] = {"b", 3};
    EXPECT_EQ(decided(1, kRead), "to a/1");
    EXPECT_EQ(decided(1, kWrite), "to a/1");
    EXPECT_EQ(decided(3, kRead), "to b/3");
    EXPECT_EQ(decided(101, kWrite), "to b/3");
}

TEST_F(DispatchTest, AMalformedReadIsMalformedWhereOnlyReadsAreAllowed) {
    settings.read_only = true;
    for (const Bytes& pdu : {"03 00"_hex, "07 00"_hex, "2B 0E"_hex, "2B 0E 01"_hex}) {
        EXPECT_EQ(decided(1, pdu), "refused 03") << to_hex(pdu);
        EXPECT_EQ(decided(2, pdu), "refused 03") << to_hex(pdu);
        EXPECT_EQ(decided(77, pdu), "refused 0a") << to_hex(pdu);
    }
    EXPECT_EQ(decided(1, "06 00 01"_hex), "refused 01") << "a write, whatever its length";
    EXPECT_EQ(decided(1, "2B 0D 01"_hex), "refused 01") << "CANopen may write";
}

TEST_F(DispatchTest, AnImpossibleFunctionIsRefusedForEveryUnit) {
    for (const Bytes& pdu : {"00 00 00"_hex, "80 01"_hex, "83 02"_hex, "FF"_hex}) {
        EXPECT_EQ(decided(1, pdu), "refused 01") << to_hex(pdu);
        EXPECT_EQ(decided(77, pdu), "refused 01") << to_hex(pdu);
        EXPECT_EQ(decided(255, pdu), "refused 01") << to_hex(pdu);
    }
    EXPECT_EQ(decided(77, {}), "refused 03");
}

TEST_F(DispatchTest, AReadOnlyListenerRefusesEverythingElseForEveryUnit) {
    settings.read_only = true;
    EXPECT_EQ(decided(1, kRead), "to a/1");
    for (const std::uint8_t unit : Bytes{0, 1, 3, 77})
        EXPECT_EQ(decided(unit, kWrite), "refused 01") << int{unit};
    EXPECT_EQ(decided(255, kWrite), "itself") << "which refuses it, and gives its counters by 08";
    EXPECT_EQ(decided(1, "17 00 00 00 01 00 05 00 01 02 00 00"_hex), "refused 01")
        << "it reads, and writes as well";
    EXPECT_EQ(decided(1, "41 01"_hex), "refused 01") << "nobody knows what it does";
}

TEST_F(DispatchTest, AWriteToAStationOnlyForReadsIsRefusedByItsBus) {
    EXPECT_EQ(decided(2, kRead), "to a/2");
    EXPECT_EQ(decided(2, kWrite), "to a/2") << "where it is counted and told";
}

TEST_F(DispatchTest, MissingRightsAreReportedBeforeTheRequestIsChecked) {
    EXPECT_EQ(decided(1, "06 00"_hex), "refused 03");
    EXPECT_EQ(decided(2, "06 00"_hex), "refused 01");
    EXPECT_EQ(decided(0, "06 00"_hex), "refused 01") << "station 2 is among them";
    bus_a.rights = {};
    EXPECT_EQ(decided(2, "06 00"_hex), "refused 03");
    EXPECT_EQ(decided(0, "06 00"_hex), "refused 03");
}

TEST_F(DispatchTest, ARefusalIsCountedByTheTargetBus) {
    const auto asked = [&](std::uint8_t unit, const Bytes& pdu) {
        const UnitMap units(settings, {{"a", &bus_a, {1, 2}, false}, {"b", &bus_b, {3}, false}});
        std::string text;
        const Decision decision = decide(unit, pdu, settings, units);
        for (const Target& target : std::get<Refuse>(decision).asked)
            text += name_of(target.bus) + '/' + std::to_string(target.station) + ' ';
        return text;
    };
    EXPECT_EQ(asked(1, "06 00"_hex), "a/1 ");
    EXPECT_EQ(asked(2, "06 00"_hex), "a/2 ");
    EXPECT_EQ(asked(0, kWrite), "a/0 ") << "the line that would have refused it";
    EXPECT_EQ(asked(77, kWrite), "");
    bus_a.rights = {};
    EXPECT_EQ(asked(0, kRead), "a/0 b/0 ");
    settings.broadcast = BroadcastMode::deny;
    EXPECT_EQ(asked(0, kWrite), "a/0 b/0 ");
    settings.read_only = true;
    EXPECT_EQ(asked(3, kWrite), "b/3 ");
}

TEST_F(DispatchTest, AnUnroutedUnitIsReportedBeforeTheRequestIsChecked) {
    EXPECT_EQ(decided(77, kRead), "refused 0a");
    EXPECT_EQ(decided(77, kTooMuch), "refused 0a");
    EXPECT_EQ(decided(248, kWrite), "refused 0a");
}

TEST_F(DispatchTest, ARequestThatContradictsItselfDoesNotLeave) {
    EXPECT_EQ(decided(1, kTooMuch), "refused 03");
    EXPECT_EQ(decided(1, "03 00 00"_hex), "refused 03");
    EXPECT_EQ(decided(1, "10 00 00 00 02 04 00 01"_hex), "refused 03");
}

TEST_F(DispatchTest, TheDiagnosticsUnitIsTheGatewayUnlessItIsGivenAway) {
    EXPECT_EQ(decided(255, kRead), "itself");
    EXPECT_EQ(decided(255, kWrite), "itself") << "whether it can be written it says itself";
    settings.units[255] = {"b", 3};
    EXPECT_EQ(decided(255, kRead), "to b/3");
    settings.units.clear();
    settings.diagnostics_unit.reset();
    EXPECT_EQ(decided(255, kRead), "refused 0a");
}

TEST_F(DispatchTest, OnlyAWriteIsBroadcastAndOnlyWhereAllMayBeWritten) {
    settings.lines = {"b"};
    EXPECT_EQ(decided(0, kWrite), "to everybody on b");
    EXPECT_EQ(decided(0, kRead), "refused 01");
    EXPECT_EQ(decided(0, "10 00 00 00 02 04 00 01"_hex), "refused 03");
    settings.lines = {"a", "b"};
    EXPECT_EQ(decided(0, kWrite), "refused 01") << "station 2 is among them";
    settings.units[100] = {"b", 0};
    EXPECT_EQ(decided(100, kWrite), "to everybody on b");
    settings.units[200] = {"a", 0};
    EXPECT_EQ(decided(200, kWrite), "refused 01");
}

TEST_F(DispatchTest, WhereBroadcastsAreDeniedNoRequestToAllIsLookedAt) {
    settings.lines = {"b"};
    settings.broadcast = BroadcastMode::deny;
    EXPECT_EQ(decided(0, kWrite), "refused 01");
    EXPECT_EQ(decided(0, "10 00 00 00 02 04 00 01"_hex), "refused 01");
    EXPECT_EQ(decided(3, kWrite), "to b/3");
}

}  // namespace
}  // namespace panelgate::tcp_server::dispatch_test
