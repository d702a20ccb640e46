#include "panelgate/tcp_server/dispatch.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "held_bus.hpp"
#include "support/hex.hpp"

namespace panelgate::tcp_server::dispatch_test {
namespace {

/// Lines "a" and "b", whose stations each test says.
class TwoLines : public ::testing::Test {
  protected:
    std::string name_of(const bus::BusClient* line) const { return line == &bus_a ? "a" : "b"; }
    std::string names_of(const std::vector<bus::BusClient*>& buses) const {
        std::string text;
        for (const bus::BusClient* line : buses) text += ' ' + name_of(line);
        return text;
    }

    boost::asio::io_context context;
    ManualBus bus_a{context};
    ManualBus bus_b{context};
    std::vector<LineInfo> lines{{"a", &bus_a, {1, 2}, true}, {"b", &bus_b, {2, 11}, true}};
    Settings settings;
};

/// Station 2 is on both lines.
class UnitMapTest : public TwoLines {
  protected:
    /// "a/1", or "" if the unit is not routed.
    std::string route(std::uint8_t unit) const {
        const auto target = UnitMap(settings, lines).route(unit);
        if (target) return name_of(target->bus) + '/' + std::to_string(target->station);
        EXPECT_EQ(target.error(), Fault::not_routed);
        return "";
    }
    std::string broadcast(std::uint8_t unit) const {
        return names_of(UnitMap(settings, lines).broadcast_lines(unit));
    }
};

TEST_F(UnitMapTest, RoutesAStationToItsLineUnlessItIsOnTwo) {
    settings.lines = {"a", "b"};
    settings.units[102] = {"b", 2};
    EXPECT_EQ(route(1), "a/1");
    EXPECT_EQ(route(11), "b/11");
    EXPECT_EQ(route(2), "");
    EXPECT_EQ(route(102), "b/2");
}

TEST_F(UnitMapTest, PassesUnlistedUnitsOnlyOnAListenerWithOneLine) {
    settings.lines = {"a", "b"};
    EXPECT_EQ(route(3), "");
    settings.lines = {"a"};
    EXPECT_EQ(route(3), "a/3");
    EXPECT_EQ(route(247), "a/247");
    lines[0].pass_unlisted = false;
    EXPECT_EQ(route(3), "");
    EXPECT_EQ(route(1), "a/1");
}

TEST_F(UnitMapTest, RoutesNothingAbove247UnlessItIsListedOrAnAlias) {
    settings.lines = {"a"};
    settings.units[250] = {"b", 11};
    lines[0].stations.push_back(254);
    for (const std::uint8_t unit : Bytes{248, 249, 251, 255}) EXPECT_EQ(route(unit), "");
    EXPECT_EQ(route(254), "a/254");
    EXPECT_EQ(route(250), "b/11") << "an alias may leave the listener's lines";
    EXPECT_TRUE(UnitMap(settings, lines).is_alias(250));
}

TEST_F(UnitMapTest, BroadcastsUnitZeroToEveryLineUnlessItIsMapped) {
    settings.lines = {"b", "a"};
    settings.units[100] = {"b", 0};
    EXPECT_EQ(broadcast(0), " b a");
    EXPECT_EQ(broadcast(1), "");
    EXPECT_EQ(broadcast(100), " b");
    EXPECT_EQ(route(0), "");
    settings.units[0] = {"a", 1};
    EXPECT_EQ(broadcast(0), "");
    EXPECT_EQ(route(0), "a/1");
}

TEST_F(UnitMapTest, AnImageIsServedByListenersThatServeAllItsLines) {
    LineInfo image{"image x", &bus_b, {100}};
    image.shows = {"b"};
    lines.push_back(image);
    EXPECT_EQ(route(100), "b/100");
    settings.lines = {"b", "a"};
    EXPECT_EQ(route(100), "b/100");
    EXPECT_EQ(broadcast(0), " b a") << "an image is no line";
    settings.lines = {"a"};
    lines[0].pass_unlisted = false;
    EXPECT_EQ(route(100), "");
    lines[2].shows->clear();
    EXPECT_EQ(route(100), "b/100") << "an image without points shows nothing of others";
}

TEST_F(UnitMapTest, RefusesALineThatIsNotThere) {
    settings.lines = {"c"};
    EXPECT_THROW(route(1), std::invalid_argument);
    settings.lines = {"a"};
    settings.units[9] = {"c", 1};
    EXPECT_THROW(route(1), std::invalid_argument);
}

const Bytes kRead = "03 00 00 00 01"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;
const Bytes kTooMuch = "03 00 00 00 7E"_hex;  // 126 registers
const Bytes kBroken = "10 00 00 00 02 04 00 01"_hex;

/// Stations 1 and 2 on "a", 2 read-only; 3 on "b".
class DispatchTest : public TwoLines {
  protected:
    DispatchTest() {
        lines = {{"a", &bus_a, {1, 2}, false}, {"b", &bus_b, {3}, false}};
        settings.diagnostics_unit = 255;
        bus_a.protect(2);
    }
    Decision decision_on(std::uint8_t unit, const Bytes& pdu) {
        const UnitMap units(settings, lines);
        return decide(unit, pdu, settings, units);
    }
    /// Returns "to a/1", "to everybody on a b", "itself", or the exception code as "refused 01".
    std::string decided(std::uint8_t unit, const Bytes& pdu) {
        const Decision decision = decision_on(unit, pdu);
        if (const auto* refuse = std::get_if<Refuse>(&decision))
            return "refused " + to_hex(Bytes{static_cast<std::uint8_t>(refuse->code)});
        if (const auto* forward = std::get_if<Forward>(&decision))
            return "to " + name_of(forward->target.bus) + '/' +
                   std::to_string(forward->target.station);
        if (std::holds_alternative<Diagnose>(decision)) return "itself";
        return "to everybody on" + names_of(std::get<Broadcast>(decision).lines);
    }
    struct Row {
        std::uint8_t unit;
        Bytes pdu;
        const char* decision;
    };
    void expect_decided(const std::vector<Row>& rows) {
        for (const Row& row : rows)
            EXPECT_EQ(decided(row.unit, row.pdu), row.decision)
                << int{row.unit} << ": " << to_hex(row.pdu);
    }
};

TEST_F(DispatchTest, ForwardsWhatIsWellFormedToTheStationThatTheUnitStandsFor) {
    settings.units = {{101, {"b", 3}}, {0, {"b", 3}}};
    expect_decided({
        {1, kRead, "to a/1"},
        {1, kWrite, "to a/1"},
        {3, kRead, "to b/3"},
        {101, kWrite, "to b/3"},
        {0, kRead, "to b/3"},  // as it is mapped
        {2, kRead, "to a/2"},
        {2, kWrite, "to a/2"},  // its bus refuses it, counts it and tells it
        // Contradicts itself, or its reply would not fit.
        {1, kTooMuch, "refused 03"},
        {1, "03 00 00"_hex, "refused 03"},
        {1, "03 00 00 00 01 00"_hex, "refused 03"},
        {1, "01 00 00 07 D9"_hex, "refused 03"},
        {1, kBroken, "refused 03"},
        // An unrouted unit is reported before the request is checked.
        {77, kRead, "refused 0a"},
        {77, kTooMuch, "refused 0a"},
        {248, kWrite, "refused 0a"},
        {77, {}, "refused 03"},
    });
    // An impossible function is refused for every unit.
    for (const Bytes& pdu : {"00 00 00"_hex, "80 01"_hex, "83 02"_hex, "FF"_hex})
        for (const std::uint8_t unit : Bytes{1, 77, 255})
            EXPECT_EQ(decided(unit, pdu), "refused 01") << to_hex(pdu);
}

TEST_F(DispatchTest, AReadOnlyListenerRefusesEverythingElseForEveryUnit) {
    settings.read_only = true;
    expect_decided({
        {1, kRead, "to a/1"},
        {0, kWrite, "refused 01"},
        {1, kWrite, "refused 01"},
        {3, kWrite, "refused 01"},
        {77, kWrite, "refused 01"},
        {255, kWrite, "itself"},  // which refuses it, and gives its counters by 08
        {1, "17 00 00 00 01 00 05 00 01 02 00 00"_hex, "refused 01"},  // it writes as well
        {1, "41 01"_hex, "refused 01"},                                // nobody knows what it does
        {1, "06 00 01"_hex, "refused 01"},  // a write, whatever its length
        {1, "2B 0D 01"_hex, "refused 01"},  // CANopen may write
    });
    // A malformed read is malformed.
    for (const Bytes& pdu : {"03 00"_hex, "07 00"_hex, "2B 0E"_hex, "2B 0E 01"_hex})
        expect_decided({{1, pdu, "refused 03"}, {2, pdu, "refused 03"}, {77, pdu, "refused 0a"}});
}

TEST_F(DispatchTest, MissingRightsAreReportedBeforeTheRequestIsChecked) {
    expect_decided({
        {1, "06 00"_hex, "refused 03"},
        {2, "06 00"_hex, "refused 01"},
        {0, "06 00"_hex, "refused 01"},  // station 2 is among them
    });
    bus_a.rights = {};
    expect_decided({{2, "06 00"_hex, "refused 03"}, {0, "06 00"_hex, "refused 03"}});
}

TEST_F(DispatchTest, ARefusalIsCountedByTheTargetBus) {
    const auto asked = [&](std::uint8_t unit, const Bytes& pdu) {
        std::string text;
        const auto decision = decision_on(unit, pdu);
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

TEST_F(DispatchTest, TheDiagnosticsUnitIsTheGatewayUnlessItIsGivenAway) {
    expect_decided({{255, kRead, "itself"}, {255, kWrite, "itself"}});
    settings.units[255] = {"b", 3};
    EXPECT_EQ(decided(255, kRead), "to b/3");
    settings.units.clear();
    settings.diagnostics_unit.reset();
    EXPECT_EQ(decided(255, kRead), "refused 0a");
}

TEST_F(DispatchTest, OnlyAWriteIsBroadcastAndOnlyWhereAllMayBeWritten) {
    settings.lines = {"b"};
    expect_decided({
        {0, kWrite, "to everybody on b"},
        {0, kRead, "refused 0a"},  // nothing has this address
        {0, kTooMuch, "refused 0a"},
        {0, "16 00 00 00 00 00 00"_hex, "refused 01"},
        {0, "17 00 00 00 01 00 00 00 01 02 00 01"_hex, "refused 01"},
        {0, kBroken, "refused 03"},
    });
    settings.lines = {"a", "b"};
    settings.units[100] = {"b", 0};
    settings.units[200] = {"a", 0};
    expect_decided({
        {0, kWrite, "refused 01"},  // station 2 is among them
        {100, kWrite, "to everybody on b"},
        {200, kWrite, "refused 01"},
    });
    settings.lines = {"b"};
    settings.broadcast = BroadcastMode::deny;  // then no request to all is looked at
    expect_decided({{0, kWrite, "refused 01"}, {0, kBroken, "refused 01"}, {3, kWrite, "to b/3"}});
}

TEST_F(DispatchTest, WhoOnlyReadsWritesNothingAndNeedsNoOtherRight) {
    const UnitMap units(settings, lines);
    const auto is_refused = [&](std::uint8_t unit, const Bytes& pdu) {
        return std::holds_alternative<Refuse>(decide(unit, pdu, settings, units, true));
    };
    EXPECT_TRUE(is_refused(1, kWrite));
    EXPECT_TRUE(is_refused(0, kWrite));
    EXPECT_FALSE(is_refused(1, kRead));
}

// The role in a client's certificate, with `role_from: certificate` (SEC-05).
TEST(Caller, ReadsOnlyUnlessItsCertificateSaysMore) {
    const auto certified = [](std::optional<std::string> role) {
        Caller caller("10.0.0.7:1", make_who({.name = "modbus_tcp 10.0.0.7:1",
                                              .address = "10.0.0.7",
                                              .standing = Role::operator_}));
        caller.certify("CN=panel", std::move(role));
        EXPECT_EQ(caller.who()->certificate, "CN=panel");
        return caller;
    };
    for (const char* role : {"", "viewer", "cook", "Operator"})
        EXPECT_TRUE(certified(role).reads_only()) << role;
    for (const char* role : {"operator", "engineer", "admin"})
        EXPECT_FALSE(certified(role).reads_only()) << role;
    EXPECT_FALSE(certified(std::nullopt).reads_only());
    EXPECT_EQ(certified("cook").who()->certificate_role, "cook");
    EXPECT_EQ(certified("cook").who()->standing.role, Role::none);
    EXPECT_EQ(certified(std::nullopt).who()->standing.role, Role::operator_);
}

TEST(Caller, HasTheOwnRoleThatItsCertificateNames) {
    std::vector<OwnRole> roles{{"setter", {}}, {"keeper", {}}};
    roles[0].rights.add(Right::write);
    roles[1].rights.add(Right::reload);
    Caller caller("10.0.0.7:1", make_who({.standing = Role::operator_}));
    caller.certify("CN=panel", "setter", roles);
    EXPECT_EQ(caller.who()->standing.name(), "setter");
    EXPECT_FALSE(caller.reads_only());
    caller.certify("CN=panel", "keeper", roles);
    EXPECT_TRUE(caller.reads_only());
}

}  // namespace
}  // namespace panelgate::tcp_server::dispatch_test
