#include "panelgate/sim/station.hpp"

#include <gtest/gtest.h>

#include <string>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"

namespace panelgate::sim::station_rules_test {
namespace {

constexpr std::int64_t kWall = 1795244523;  // Saturday 2026-11-21 07:02:03

const profile::PanelProfile& shipped(std::string_view name) {
    static const profile::Catalogue catalogue = profile::Catalogue::shipped();
    return *catalogue.find(name);
}

/// A panel with requests and replies in hex.
class Panel {
  public:
    explicit Panel(std::string_view name, std::uint8_t id = 7) : Panel(shipped(name), id) {}
    explicit Panel(const profile::PanelProfile& profile, std::uint8_t id = 7)
        : station_(profile, id) {}

    std::string ask(std::string_view pdu, Duration at = 0s, std::int64_t wall = kWall) {
        return to_hex(station_.handle(TimePoint{} + at, wall, from_hex(pdu).value()));
    }
    std::string ask(const Bytes& pdu) { return to_hex(station_.handle(TimePoint{}, kWall, pdu)); }
    void tell_all(std::string_view pdu) {
        station_.broadcast(TimePoint{}, kWall, from_hex(pdu).value());
    }
    Station& station() { return station_; }

  private:
    Station station_;
};

TEST(Station, RefusesFunctionsThatTheManualDoesNotListWith01) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("02 00 00 00 01"), "82 01");
    EXPECT_EQ(gplp.ask("04 00 00 00 05"), "84 01");
    EXPECT_EQ(gplp.ask("05 01 20 FF 00"), "85 01");
    EXPECT_EQ(gplp.ask("06 00 64 00 01"), "86 01");
    EXPECT_EQ(gplp.ask("41"), "c1 01");
    Panel gp("autonics-gp-2005");
    EXPECT_EQ(gp.ask("01 01 20 00 05"), "81 01");
    EXPECT_EQ(gp.ask("0F 06 40 00 05 01 1A"), "8f 01");
    Panel arm("autonics-arm");
    EXPECT_EQ(arm.ask("0F 00 00 00 01 01 01"), "8f 01");
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("02 00 00 00 01"), "82 01");
}

TEST(Station, JudgesTheFunctionBeforeTheQuantityAndTheQuantityBeforeTheAddress) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("04 FF FF 00 00"), "84 01");
    EXPECT_EQ(gplp.ask("03 FF FF 00 00"), "83 03");
    EXPECT_EQ(gplp.ask("03 FF FF 00 01"), "83 02");
    EXPECT_EQ(gplp.ask("10 FF FF 00 02 02 00 01"), "90 03");
    EXPECT_EQ(gplp.ask("10 FF FF 00 01 02 00 01"), "90 02");
}

TEST(Station, RefusesQuantitiesBeyondThePanelsLimitWith03) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("01 00 00 00 00"), "81 03");
    EXPECT_EQ(gplp.ask("01 00 00 07 D1"), "81 03");
    EXPECT_EQ(gplp.ask("01 00 00 07 D0").substr(0, 5), "01 fa");
    EXPECT_EQ(gplp.ask("03 00 00 00 7E"), "83 03");
    EXPECT_EQ(gplp.ask("03 00 00 00 7D").substr(0, 5), "03 fa");
    EXPECT_EQ(gplp.ask("0F 06 40 00 00 00"), "8f 03");
    Panel cp2e("omron-cp2e");
    EXPECT_EQ(cp2e.ask("01 00 00 07 D1"), "81 03");
    EXPECT_EQ(cp2e.ask("01 00 00 07 D0").substr(0, 5), "01 fa");
}

TEST(Station, AnswersTheLargerFramesOfTheGt) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(from_hex(gt.ask("01 00 00 07 F8"))->size(), 257u);
    EXPECT_EQ(gt.ask("01 00 00 07 F9"), "81 03");
    EXPECT_EQ(from_hex(gt.ask("03 00 00 00 7F"))->size(), 256u);
    EXPECT_EQ(gt.ask("03 00 00 00 80"), "83 03");
    EXPECT_EQ(gt.ask(modbus::encode_write_coils(0, std::vector<bool>(2040, true))),
              "0f 00 00 07 f8");
    EXPECT_EQ(gt.ask(modbus::encode_write_registers(0, std::vector<std::uint16_t>(127, 9))),
              "10 00 00 00 7f");
    EXPECT_EQ(gt.station().peek("GR", 2039), 1);
    EXPECT_EQ(gt.station().peek("GR", 2040), 0);
    EXPECT_EQ(gt.station().peek("GDT", 126), 9);
}

TEST(Station, RefusesWhatIsMalformedWith03) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("03 00 00"), "83 03");
    EXPECT_EQ(gplp.ask("03"), "83 03");
    EXPECT_EQ(gplp.ask("03 00 00 00 01 00"), "83 03");
    EXPECT_EQ(gplp.ask("0F 06 40 00 05 02 1A 00"), "8f 03");
    EXPECT_EQ(gplp.ask("0F 06 40 00 05 01"), "8f 03");
    EXPECT_EQ(gplp.ask("10 00 64 00 02 02 00 01"), "90 03");
    EXPECT_EQ(gplp.ask("10 00 64 00 01 04 00 01 00 02"), "90 03");
    EXPECT_EQ(gplp.ask(Bytes()), "");
}

TEST(Station, TakesOnly0000AndFf00AsTheValueOfASingleBit) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("05 01 13 FF 00"), "05 01 13 ff 00");
    EXPECT_EQ(gt.station().peek("GR", 275), 1);
    for (const char* request :
         {"05 01 13 12 34", "05 01 13 FF 01", "05 01 13 00 01", "05 01 13 01 00"}) {
        EXPECT_EQ(gt.ask(request), "85 03") << request;
    }
    EXPECT_EQ(gt.station().peek("GR", 275), 1);
    EXPECT_EQ(gt.ask("05 01 13 00 00"), "05 01 13 00 00");
    EXPECT_EQ(gt.station().peek("GR", 275), 0);
    EXPECT_EQ(gt.ask("05 10 00 12 34"), "85 03") << "the value is judged before the address";
    EXPECT_EQ(gt.ask("05 10 00 FF 00"), "85 02");
}

TEST(Station, RefusesAddressesOutsideTheAreasWith02) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("03 17 9F 00 01"), "03 02 00 00");
    EXPECT_EQ(gplp.ask("03 17 9F 00 02"), "83 02");
    EXPECT_EQ(gplp.ask("03 17 A0 00 01"), "83 02");
    EXPECT_EQ(gplp.ask("01 FF FF 00 01"), "01 01 00");
    EXPECT_EQ(gplp.ask("01 FF FF 00 02"), "81 02") << "no wrap to UB0";
    EXPECT_EQ(gplp.ask("10 17 9F 00 02 04 00 01 00 02"), "90 02");
    EXPECT_EQ(gplp.station().peek("UW", 6047), 0) << "nothing is written in part";
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("03 07 FF 00 02"), "83 02");
    EXPECT_EQ(gt.ask("03 23 77 00 01"), "83 02");
    EXPECT_EQ(gt.ask("03 23 7E 00 02"), "83 02");
    EXPECT_EQ(gt.ask("06 08 00 00 01"), "86 02");
    Panel arm("autonics-arm");
    EXPECT_EQ(arm.ask("01 00 40 00 01"), "81 02");
    EXPECT_EQ(arm.ask("05 00 40 FF 00"), "85 02");
}

TEST(Station, RefusesWritesIntoTheProtectedPartOfAPanel) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("10 00 0E 00 01 02 00 01"), "90 03") << "UW14";
    EXPECT_EQ(gplp.ask("10 00 0E 00 02 04 00 01 00 02"), "90 03") << "UW14 and UW15";
    EXPECT_EQ(gplp.station().peek("UW", 15), 0);
    EXPECT_EQ(gplp.ask("10 00 0F 00 01 02 00 09"), "10 00 0f 00 01") << "UW15";
    EXPECT_EQ(gplp.ask("0F 00 EF 00 01 01 01"), "8f 03") << "UB14F";
    EXPECT_EQ(gplp.ask("0F 00 F0 00 01 01 00"), "0f 00 f0 00 01") << "UB150";
    EXPECT_EQ(gplp.station().peek("UW", 15), 8);
    Panel gplp_a("autonics-gplp-a");
    EXPECT_EQ(gplp_a.ask("10 00 50 00 01 02 00 01"), "90 03") << "UW80";
    EXPECT_EQ(gplp_a.ask("10 00 51 00 01 02 00 01"), "10 00 51 00 01") << "UW81";
    EXPECT_EQ(gplp_a.ask("0F 05 0F 00 01 01 01"), "8f 03") << "UB80F";
    EXPECT_EQ(gplp_a.ask("0F 05 10 00 01 01 01"), "0f 05 10 00 01") << "UB810";
}

TEST(Station, AnswersProtectedWritesAsTheProfileChooses) {
    profile::PanelProfile chosen = shipped("autonics-gplp-s");
    chosen.simulation.protected_exception = 2;
    Panel gplp(chosen);
    EXPECT_EQ(gplp.ask("10 00 0E 00 01 02 00 01"), "90 02");
    EXPECT_EQ(gplp.ask("0F 00 EF 00 01 01 01"), "8f 02");
}

TEST(Station, RefusesAWriteThatRunsOutOfTheWritablePart) {
    profile::PanelProfile chosen = shipped("autonics-gplp-s");
    for (profile::Area& area : chosen.areas)
        if (area.name == "UW") area.writable->last = 100;
    Panel gplp(chosen);
    EXPECT_EQ(gplp.ask("10 00 64 00 02 04 00 01 00 02"), "90 03") << "UW100 and UW101";
    EXPECT_EQ(gplp.station().peek("UW", 100), 0);
    EXPECT_EQ(gplp.ask("10 00 64 00 01 02 00 01"), "10 00 64 00 01");
}

TEST(Station, SharesTheMemoryOfWordsAndTheirBits) {
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("03 00 12 00 01"), "03 02 00 19") << "UB180 to UB184 are bits of UW18";
    EXPECT_EQ(gplp.ask("0F 06 40 00 05 01 1A"), "0f 06 40 00 05");
    EXPECT_EQ(gplp.ask("03 00 64 00 01"), "03 02 00 1a");
    EXPECT_EQ(gplp.ask("10 00 64 00 01 02 80 01"), "10 00 64 00 01");
    EXPECT_EQ(gplp.ask("01 06 40 00 10"), "01 02 01 80");
    EXPECT_EQ(gplp.ask("0F 06 4F 00 01 01 00"), "0f 06 4f 00 01");
    EXPECT_EQ(gplp.station().peek("UW", 100), 1) << "the other bits of the word stay";
    gplp.station().poke("UB", 1601, 1);
    EXPECT_EQ(gplp.station().peek("UW", 100), 3);
}

TEST(Station, ReadsTheRegistersOfTheGtByBothFunctions) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("06 01 FE 12 34"), "06 01 fe 12 34");
    EXPECT_EQ(gt.ask("03 01 FE 00 01"), "03 02 12 34");
    EXPECT_EQ(gt.ask("04 01 FE 00 01"), "04 02 12 34");
}

TEST(Station, KeepsTheFourTablesOfTheArmApart) {
    Panel arm("autonics-arm");
    EXPECT_EQ(arm.ask("06 00 00 12 34"), "06 00 00 12 34");
    EXPECT_EQ(arm.ask("03 00 00 00 01"), "03 02 12 34");
    EXPECT_EQ(arm.ask("04 00 00 00 01"), "04 02 00 0a");
    EXPECT_EQ(arm.ask("05 00 3F FF 00"), "05 00 3f ff 00");
    EXPECT_EQ(arm.ask("02 00 3F 00 01"), "02 01 00");
    EXPECT_EQ(arm.ask("03 04 04 00 03"), "03 06 00 01 00 02 00 00") << "401029 to 401031";
    EXPECT_EQ(arm.ask("04 00 6C 00 02"), "04 04 4e 2d 34 53") << "300109 N, 300110 4S";
}

TEST(Station, ExecutesBroadcastsThatTheManualAllows) {
    Panel gplp("autonics-gplp-s");
    gplp.tell_all("10 00 64 00 01 02 00 7B");
    EXPECT_EQ(gplp.station().peek("UW", 100), 0x7B);
    gplp.tell_all("0F 06 40 00 01 01 00");
    EXPECT_EQ(gplp.station().peek("UW", 100), 0x7A);
    Panel gt("panasonic-gt");
    gt.tell_all("06 01 FE 12 34");
    EXPECT_EQ(gt.station().peek("GDT", 510), 0x1234);
    gt.tell_all("05 01 13 FF 00");
    EXPECT_EQ(gt.station().peek("GR", 275), 1);
}

TEST(Station, IgnoresEveryOtherBroadcast) {
    Panel arm("autonics-arm");
    arm.tell_all("06 00 00 12 34");
    EXPECT_EQ(arm.station().peek("4", 0), 0) << "the legible pages allow no broadcast";
    Panel gplp("autonics-gplp-s");
    gplp.tell_all("03 00 00 00 05");
    gplp.tell_all("06 00 64 00 01");
    gplp.tell_all("10 00 0E 00 02 04 00 01 00 02");
    gplp.tell_all("10 00 64 00 02 02 00 01");
    gplp.tell_all("");
    EXPECT_EQ(gplp.station().peek("UW", 100), 0);
    EXPECT_EQ(gplp.station().peek("UW", 15), 0);
}

TEST(Station, ShowsTheTimeInTheClockOfTheGt) {
    Panel gt("panasonic-gt");
    const std::string shown = "0e 00 03 00 02 00 07 00 15 00 0b 00 1a 00 06";
    EXPECT_EQ(gt.ask("03 23 78 00 07"), "03 " + shown);
    EXPECT_EQ(gt.ask("04 23 78 00 07"), "04 " + shown);
    EXPECT_EQ(gt.ask("03 23 78 00 02", 58s, kWall + 58), "03 04 00 01 00 03") << "it runs";
    EXPECT_EQ(gt.ask("03 23 7D 00 01"), "03 02 00 1a") << "GDT9085: the year's last two digits";
}

TEST(Station, RefusesToSetTheClockOfTheGt) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("06 23 78 00 00"), "86 03");
    EXPECT_EQ(gt.ask("10 23 78 00 01 02 00 00"), "90 03");
    gt.tell_all("06 23 78 00 00");
    EXPECT_EQ(gt.ask("03 23 78 00 01"), "03 02 00 03");
}

TEST(Station, MovesSomeValuesWithTime) {
    Panel gp("autonics-gp-2005");
    EXPECT_EQ(gp.ask("03 00 C8 00 02", 100s), "03 04 00 00 01 68") << "where the first request was";
    EXPECT_EQ(gp.ask("03 00 C8 00 01", 130s), "03 02 02 d5") << "half of 1450 after half of 60 s";
    EXPECT_EQ(gp.ask("03 00 C8 00 01", 160s), "03 02 00 00");
    EXPECT_EQ(gp.ask("03 00 C9 00 01", 122500ms), "03 02 01 68")
        << "the sine is back in the middle";
    Panel gplp("autonics-gplp-s");
    EXPECT_EQ(gplp.ask("01 0D 20 00 01", 0s), "01 01 00");
    EXPECT_EQ(gplp.ask("01 0D 20 00 01", 5s), "01 01 01");
    EXPECT_EQ(gplp.ask("01 0D 20 00 01", 10s), "01 01 00");
}

TEST(Station, KeepsMovingValuesInTheirLimits) {
    for (const char* name : {"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005",
                             "autonics-arm", "panasonic-gt", "omron-cp2e"}) {
        const profile::PanelProfile& profile = shipped(name);
        Panel panel(profile);
        for (int second = 0; second < 400; ++second) {
            panel.ask("03 FF FF 00 01", Duration(second * 1s));
            for (const auto& motion : profile.simulation.motion) {
                if (motion.kind == profile::Simulation::Motion::Kind::clock) continue;
                const auto value = panel.station().peek(motion.area, motion.address);
                ASSERT_LE(value, motion.high) << name << ' ' << motion.address;
                ASSERT_GE(value,
                          motion.kind == profile::Simulation::Motion::Kind::toggle ? 0 : motion.low)
                    << name << ' ' << motion.address;
            }
        }
    }
}

TEST(Station, AnswersAnAreaOnlyAsAWhole) {
    Panel gt("panasonic-gt");
    gt.station().poke("GDT", 2047, 0xBEEF);
    EXPECT_EQ(gt.ask("03 07 FF 00 01"), "03 02 be ef");
    EXPECT_EQ(gt.ask("01 0F FF 00 01"), "01 01 00");
    EXPECT_EQ(gt.ask("01 0F FF 00 02"), "81 02");
}

TEST(GenericStation, MasksAWordAsTheStandardsExample) {
    Panel any("generic");
    any.station().poke("4", 4, 0x12);
    EXPECT_EQ(any.ask("16 00 04 00 F2 00 25"), "16 00 04 00 f2 00 25");
    EXPECT_EQ(any.station().peek("4", 4), 0x17);
}

TEST(GenericStation, WritesBeforeItReads) {
    Panel any("generic");
    EXPECT_EQ(any.ask("17 00 0E 00 03 00 0E 00 02 04 00 FF 00 01"), "17 06 00 ff 00 01 00 00");
    const auto write = [](unsigned count) {
        const Bytes data(2 * count, 0);
        Writer out;
        out.u8(0x17).u16(0).u16(1).u16(0).u16(count).u8(2 * count).raw(data);
        return out.take();
    };
    EXPECT_EQ(any.ask(write(121)), "17 02 00 00");
    EXPECT_EQ(any.ask(write(122)), "97 03");
    EXPECT_EQ(any.ask("17 FF FF 00 02 00 0E 00 01 02 00 01"), "97 02");
}

TEST(GenericStation, ReportsItsStateAndName) {
    Panel any("generic", 9);
    EXPECT_EQ(any.ask("07"), "07 00");
    EXPECT_EQ(any.ask("08 00 00 A5 37"), "08 00 00 a5 37");
    EXPECT_EQ(any.ask("08 00 01 00 00"), "88 01");
    EXPECT_EQ(any.ask("11"), "11 09 09 ff 67 65 6e 65 72 69 63");
}

TEST(GenericStation, CountsTheRequestsThatItAnsweredNormally) {
    Panel any("generic");
    EXPECT_EQ(any.ask("0B"), "0b 00 00 00 00");
    any.ask("03 00 00 00 01");
    any.ask("03 00 00 00 00");
    any.ask("07");
    EXPECT_EQ(any.ask("0B"), "0b 00 00 00 02");
    EXPECT_EQ(any.ask("0B"), "0b 00 00 00 02");
}

TEST(GenericStation, IdentifiesItself) {
    Panel any("generic");
    const std::string vendor = "00 09 70 61 6e 65 6c 67 61 74 65";
    const std::string product = "01 07 67 65 6e 65 72 69 63";
    const std::string revision = "02 09 73 69 6d 75 6c 61 74 65 64";
    EXPECT_EQ(any.ask("2B 0E 01 00"),
              "2b 0e 01 81 00 00 03 " + vendor + ' ' + product + ' ' + revision);
    EXPECT_EQ(any.ask("2B 0E 01 02"), "2b 0e 01 81 00 00 01 " + revision);
    EXPECT_EQ(any.ask("2B 0E 01 07"), any.ask("2B 0E 01 00")) << "an unknown object starts over";
    EXPECT_EQ(any.ask("2B 0E 04 01"), "2b 0e 04 81 00 00 01 " + product);
    EXPECT_EQ(any.ask("2B 0E 04 03"), "ab 02");
    EXPECT_EQ(any.ask("2B 0E 05 00"), "ab 03");
    EXPECT_EQ(any.ask("2B 0E 01"), "ab 03");
    EXPECT_EQ(any.ask("2B 0D 00"), "ab 01");
    EXPECT_TRUE(modbus::answers("2B 0E 01 00"_hex, *from_hex(any.ask("2B 0E 01 00"))));
}

TEST(GenericStation, RefusesWhatIsNotSimulatedWith01) {
    Panel any("generic");
    EXPECT_EQ(any.ask("0C"), "8c 01");
    EXPECT_EQ(any.ask("18 00 04"), "98 01");
    EXPECT_EQ(any.ask("14 07 06 00 04 00 01 00 02"), "94 01");
    EXPECT_EQ(any.ask("15 09 06 00 04 00 07 00 01 06 AF"), "95 01");
}

TEST(GenericStation, ReachesEveryAddress) {
    Panel any("generic");
    EXPECT_EQ(any.ask("06 FF FF AB CD"), "06 ff ff ab cd");
    EXPECT_EQ(any.ask("03 FF FF 00 01"), "03 02 ab cd");
    EXPECT_EQ(any.ask("04 FF FF 00 01"), "04 02 00 00");
    EXPECT_EQ(any.ask("05 FF FF FF 00"), "05 ff ff ff 00");
    EXPECT_EQ(any.ask("01 FF FF 00 01"), "01 01 01");
    EXPECT_EQ(any.ask("02 FF FF 00 01"), "02 01 00");
    EXPECT_EQ(any.ask("03 FF FF 00 02"), "83 02");
}

TEST(Station, KeepsItsMemoryWhenItIsMoved) {
    Station first(shipped("autonics-gplp-s"), 31);
    first.poke("UW", 500, 77);
    const Station second(std::move(first));
    EXPECT_EQ(second.id(), 31);
    EXPECT_EQ(second.peek("UW", 500), 77);
    EXPECT_EQ(second.peek("UW", 4), 50);
}

}  // namespace
}  // namespace panelgate::sim::station_rules_test
