#include "panelgate/sim/station.hpp"

#include <gtest/gtest.h>

#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"

namespace panelgate::sim::station_test {
namespace {

const profile::PanelProfile& shipped(std::string_view name) {
    static const profile::Catalogue all = profile::Catalogue::shipped();
    return *all.find(name);
}
constexpr TimePoint kStart{1h};
constexpr std::int64_t kWall = 1'795'252'225;  // 2026-11-21 09:10:25

struct Example {
    const char* name;
    const char* profile;
    const char* request;
    const char* reply;
};
class ManualExample : public testing::TestWithParam<Example> {};

TEST_P(ManualExample, IsReproduced) {
    Station station(shipped(GetParam().profile), 1);
    const Bytes request = from_hex(GetParam().request).value();
    EXPECT_EQ(to_hex(station.handle(kStart, kWall, request)),
              to_hex(from_hex(GetParam().reply).value()));
}

INSTANTIATE_TEST_SUITE_P(
    Manuals, ManualExample,
    testing::Values(
        Example{"GplpReadCoils", "autonics-gplp-s", "01 01 20 00 05", "01 01 19"},
        Example{"GplpForceCoils", "autonics-gplp-s", "0F 06 40 00 05 01 1A", "0F 06 40 00 05"},
        Example{"GplpReadWords", "autonics-gplp-s", "03 00 00 00 05",
                "03 0A 00 0A 00 14 00 1E 00 28 00 32"},
        Example{"GplpPresetWords", "autonics-gplp-s",
                "10 00 64 00 05 0A 00 7B 00 EA 01 59 01 C8 02 37", "10 00 64 00 05"},
        Example{"GplpFunction04", "autonics-gplp-s", "04 00 00 00 05", "84 01"},
        Example{"Gp2005ReadWords", "autonics-gp-2005", "03 00 1E 00 05",
                "03 0A 00 0A 00 14 00 1E 00 28 00 32"},
        Example{"Gp2005PresetWords", "autonics-gp-2005",
                "10 00 64 00 05 0A 00 7B 00 EA 01 59 01 C8 02 37", "10 00 64 00 05"},
        Example{"Gp2005Function04", "autonics-gp-2005", "04 00 00 00 05", "84 01"},
        Example{"ArmReadCoils", "autonics-arm", "01 00 00 00 0A", "01 02 CD 01"},
        Example{"ArmReadInput", "autonics-arm", "04 00 00 00 01", "04 02 00 0A"},
        Example{"ArmForceCoil", "autonics-arm", "05 00 00 FF 00", "05 00 00 FF 00"},
        Example{"ArmPresetRegister", "autonics-arm", "06 00 00 00 0A", "06 00 00 00 0A"},
        Example{"ArmPresetRegisters", "autonics-arm", "10 00 00 00 02 04 00 0A 00 0A",
                "10 00 00 00 02"},
        Example{"ArmCoil1001", "autonics-arm", "01 03 E8 00 01", "81 02"},
        Example{"ArmHasNo0F", "autonics-arm", "0F 00 00 00 01 01 01", "8F 01"},
        Example{"GtForceRelay", "panasonic-gt", "05 01 13 FF 00", "05 01 13 FF 00"},
        Example{"GtWriteWord", "panasonic-gt", "06 01 FE 12 34", "06 01 FE 12 34"},
        Example{"GtForceRelays", "panasonic-gt", "0F 00 CF 00 14 03 00 00 00", "0F 00 CF 00 14"},
        Example{"GtBadCoilValue", "panasonic-gt", "05 01 13 12 34", "85 03"},
        Example{"GtTooManyWords", "panasonic-gt", "03 00 6C 00 80", "83 03"},
        Example{"GtOutOfRange", "panasonic-gt", "03 08 00 00 01", "83 02"},
        Example{"Cp2eWriteWord", "omron-cp2e", "06 00 00 12 34", "06 00 00 12 34"},
        Example{"Cp2eReadBits", "omron-cp2e", "01 00 14 00 13", "01 03 CD B6 05"},
        Example{"Cp2eForceBits", "omron-cp2e", "0F 00 14 00 0A 02 CD 03", "0F 00 14 00 0A"},
        Example{"Cp2eWriteWords", "omron-cp2e", "10 03 E8 00 02 04 3A C5 97 13", "10 03 E8 00 02"},
        Example{"Cp2e2047BitsAreTooMany", "omron-cp2e", "01 00 00 07 FF", "81 03"}),
    [](const auto& info) { return info.param.name; });

class StationTest : public testing::Test {
  protected:
    Bytes ask(Station& station, const Bytes& pdu) { return station.handle(kStart, kWall, pdu); }
    Station press{shipped("autonics-gplp-s"), 31};
    Station oven{shipped("panasonic-gt"), 20};
};

TEST_F(StationTest, BitsAreAViewOfTheirWords) {
    ask(press, "10 00 64 00 01 02 80 01"_hex);                       // UW100 = 8001h
    EXPECT_EQ(ask(press, "01 06 40 00 10"_hex), "01 02 01 80"_hex);  // UB1000 to UB100F
    ask(press, "0F 06 41 00 01 01 01"_hex);                          // UB1001 on
    EXPECT_EQ(ask(press, "03 00 64 00 01"_hex), "03 02 80 03"_hex);
}

TEST_F(StationTest, ProtectedWordsRefuseWritesAsTheProfileSpecifies) {
    EXPECT_EQ(ask(press, "10 00 00 00 01 02 00 01"_hex), "90 03"_hex);
    EXPECT_EQ(ask(press, "0F 00 EF 00 02 01 03"_hex), "8F 03"_hex) << "half below UB150";
    EXPECT_EQ(ask(press, "03 00 00 00 01"_hex), "03 02 00 0A"_hex) << "nothing was written";
}

TEST_F(StationTest, TheWidestReadsOfTheGtFitOneByteOfByteCount) {
    EXPECT_EQ(ask(oven, "03 00 6C 00 7F"_hex).size(), 256u);
    EXPECT_EQ(ask(oven, "01 00 20 07 F8"_hex).size(), 257u);
}

TEST_F(StationTest, TheClockRunsAndRefusesWrites) {
    EXPECT_EQ(ask(oven, "03 23 78 00 07"_hex),
              "03 0E 00 19 00 0A 00 09 00 15 00 0B 00 1A 00 06"_hex);
    EXPECT_EQ(oven.handle(kStart + 1s, kWall + 1, "03 23 78 00 01"_hex), "03 02 00 1A"_hex);
    EXPECT_EQ(ask(oven, "06 23 78 00 00"_hex), "86 03"_hex);
}

TEST_F(StationTest, ABroadcastIsExecutedWhereThePanelTakesIt) {
    oven.broadcast(kStart, kWall, "06 01 FE 12 34"_hex);
    EXPECT_EQ(oven.peek("GDT", 510), 0x1234);
    Station io(shipped("autonics-arm"), 17);
    io.broadcast(kStart, kWall, "06 00 00 12 34"_hex);
    EXPECT_EQ(io.peek("4", 0), 0) << "the manual names no broadcast";
}

TEST_F(StationTest, ValuesMoveWithTime) {
    const Bytes first = oven.handle(kStart, kWall, "03 01 2D 00 01"_hex);
    const Bytes later = oven.handle(kStart + 100s, kWall, "03 01 2D 00 01"_hex);
    EXPECT_NE(first, later);
}

TEST_F(StationTest, MalformedRequestsAreRefusedNotExecuted) {
    for (const char* pdu :
         {"03 00 00", "03 00 00 00 00", "10 00 64 00 02 02 00 01", "0F 06 40 00 05 02 1A 00"}) {
        const Bytes reply = ask(press, from_hex(pdu).value());
        ASSERT_EQ(reply.size(), 2u) << pdu;
        EXPECT_EQ(reply[1], 3) << pdu;
    }
}

TEST_F(StationTest, TheGenericPanelMasksAndReadsAndWritesInOne) {
    Station any(shipped("generic"), 9);
    any.poke("4", 4, 0x12);
    EXPECT_EQ(ask(any, "16 00 04 00 F2 00 25"_hex), "16 00 04 00 F2 00 25"_hex);
    EXPECT_EQ(any.peek("4", 4), 0x17);  // AP 6.16's own example
    EXPECT_EQ(ask(any, "17 00 04 00 01 00 04 00 01 02 00 2A"_hex), "17 02 00 2A"_hex)
        << "the write comes first";
}

}  // namespace
}  // namespace panelgate::sim::station_test
