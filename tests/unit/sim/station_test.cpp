#include "panelgate/sim/station.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/vectors.hpp"

namespace panelgate::sim::station_test {
namespace {

using modbus::Table;
using Kind = profile::Simulation::Motion::Kind;

constexpr std::int64_t kWall = 1795244523;  // Saturday 2026-11-21 07:02:03

const profile::Catalogue& catalogue() {
    static const profile::Catalogue shipped = profile::Catalogue::shipped();
    return shipped;
}
const profile::PanelProfile& shipped(std::string_view name) { return *catalogue().find(name); }

/// A panel with requests and replies in hex.
struct Panel : Station {
    explicit Panel(std::string_view name, std::uint8_t id = 7) : Station(shipped(name), id) {}
    using Station::Station;

    std::string ask(const Bytes& pdu, Duration at = 0s, std::int64_t wall = kWall) {
        return to_hex(handle(TimePoint{} + at, wall, pdu));
    }
    std::string ask(std::string_view pdu, Duration at = 0s, std::int64_t wall = kWall) {
        return ask(from_hex(pdu).value(), at, wall);
    }
    /// One after the other.
    void expect(std::initializer_list<std::pair<const char*, const char*>> exchanges) {
        for (const auto& [request, reply] : exchanges) EXPECT_EQ(ask(request), reply) << request;
    }
    /// With this exception.
    void expect_refusals(std::uint8_t code, std::initializer_list<const char*> requests) {
        for (const char* request : requests) {
            const Bytes pdu = from_hex(request).value();
            const auto function = static_cast<std::uint8_t>(pdu[0] | modbus::kExceptionBit);
            EXPECT_EQ(ask(pdu), to_hex(Bytes{function, code})) << request;
        }
    }
    void tell_all(std::string_view pdu) { broadcast(TimePoint{}, kWall, from_hex(pdu).value()); }
};

TEST(Station, RefusesFunctionsThatTheManualDoesNotListWith01) {
    Panel("autonics-gplp-s")
        .expect_refusals(
            1, {"02 00 00 00 01", "04 00 00 00 05", "05 01 20 FF 00", "06 00 64 00 01", "41"});
    Panel("autonics-gp-2005").expect_refusals(1, {"01 01 20 00 05", "0F 06 40 00 05 01 1A"});
    Panel("autonics-arm").expect_refusals(1, {"0F 00 00 00 01 01 01"});
    Panel("panasonic-gt").expect_refusals(1, {"02 00 00 00 01"});
}

TEST(Station, JudgesTheFunctionBeforeTheQuantityAndTheQuantityBeforeTheAddress) {
    Panel gplp("autonics-gplp-s");
    gplp.expect_refusals(1, {"04 FF FF 00 00"});
    gplp.expect_refusals(3, {"03 FF FF 00 00", "10 FF FF 00 02 02 00 01"});
    gplp.expect_refusals(2, {"03 FF FF 00 01", "10 FF FF 00 01 02 00 01"});
}

TEST(Station, RefusesQuantitiesBeyondThePanelsLimitAndWhatIsMalformedWith03) {
    Panel gplp("autonics-gplp-s");
    gplp.expect_refusals(3, {"01 00 00 00 00", "01 00 00 07 D1", "03 00 00 00 00", "03 00 00 00 7E",
                             "0F 06 40 00 00 00"});
    EXPECT_EQ(gplp.ask("01 00 00 07 D0").substr(0, 5), "01 fa");
    EXPECT_EQ(gplp.ask("03 00 00 00 7D").substr(0, 5), "03 fa");
    gplp.expect_refusals(
        3, {"03 00 00", "03", "03 00 00 00 01 00", "0F 06 40 00 05 02 1A 00", "0F 06 40 00 05 01",
            "10 00 64 00 02 02 00 01", "10 00 64 00 01 04 00 01 00 02"});
    EXPECT_EQ(gplp.ask(""), "");
    Panel cp2e("omron-cp2e");
    cp2e.expect_refusals(3, {"01 00 00 07 D1"});
    EXPECT_EQ(cp2e.ask("01 00 00 07 D0").substr(0, 5), "01 fa");
}

TEST(Station, AnswersTheLargerFramesOfTheGt) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(from_hex(gt.ask("01 00 00 07 F8"))->size(), 257u);
    EXPECT_EQ(from_hex(gt.ask("03 00 00 00 7F"))->size(), 256u);
    gt.expect_refusals(3, {"01 00 00 07 F9", "03 00 00 00 80", "03 00 6C 00 80"});
    EXPECT_EQ(gt.ask(modbus::encode_write_coils(0, std::vector<bool>(2040, true))),
              "0f 00 00 07 f8");
    EXPECT_EQ(gt.ask(modbus::encode_write_registers(0, std::vector<std::uint16_t>(127, 9))),
              "10 00 00 00 7f");
    EXPECT_EQ(gt.peek("GR", 2039), 1);
    EXPECT_EQ(gt.peek("GR", 2040), 0);
    EXPECT_EQ(gt.peek("GDT", 126), 9);
}

TEST(Station, TakesOnly0000AndFf00AsTheValueOfASingleBit) {
    Panel gt("panasonic-gt");
    EXPECT_EQ(gt.ask("05 01 13 FF 00"), "05 01 13 ff 00");
    gt.expect_refusals(3, {"05 01 13 12 34", "05 01 13 FF 01", "05 01 13 00 01", "05 01 13 01 00"});
    EXPECT_EQ(gt.peek("GR", 275), 1);
    EXPECT_EQ(gt.ask("05 01 13 00 00"), "05 01 13 00 00");
    EXPECT_EQ(gt.peek("GR", 275), 0);
    EXPECT_EQ(gt.ask("05 10 00 12 34"), "85 03") << "the value is judged before the address";
    EXPECT_EQ(gt.ask("05 10 00 FF 00"), "85 02");
}

TEST(Station, RefusesAddressesOutsideTheAreasWith02) {
    Panel gplp("autonics-gplp-s");
    gplp.expect({{"03 17 9F 00 01", "03 02 00 00"}, {"01 FF FF 00 01", "01 01 00"}});
    gplp.expect_refusals(2, {"03 17 9F 00 02", "03 17 A0 00 01",
                             "01 FF FF 00 02",  // no wrap to UB0
                             "10 17 9F 00 02 04 00 01 00 02"});
    EXPECT_EQ(gplp.peek("UW", 6047), 0) << "nothing is written in part";
    Panel gt("panasonic-gt");
    gt.poke("GDT", 2047, 0xBEEF);
    gt.expect({{"03 07 FF 00 01", "03 02 be ef"}, {"01 0F FF 00 01", "01 01 00"}});
    gt.expect_refusals(2, {"03 07 FF 00 02", "03 08 00 00 01", "03 23 77 00 01", "03 23 7E 00 02",
                           "06 08 00 00 01", "01 0F FF 00 02"});
    Panel("autonics-arm").expect_refusals(2, {"01 00 40 00 01", "05 00 40 FF 00"});
}

TEST(Station, RefusesWritesIntoTheProtectedPartOfAPanel) {
    Panel gplp("autonics-gplp-s");
    gplp.expect_refusals(3, {"10 00 00 00 01 02 00 01",        // UW0
                             "10 00 0E 00 01 02 00 01",        // UW14
                             "10 00 0E 00 02 04 00 01 00 02",  // UW14 and UW15
                             "0F 00 EF 00 01 01 01",           // UB14F
                             "0F 00 EF 00 02 01 03"});         // UB14F and UB150
    EXPECT_EQ(gplp.peek("UW", 0), 10);
    EXPECT_EQ(gplp.peek("UW", 15), 0);
    gplp.expect({{"10 00 0F 00 01 02 00 09", "10 00 0f 00 01"},  // UW15
                 {"0F 00 F0 00 01 01 00", "0f 00 f0 00 01"}});   // UB150
    EXPECT_EQ(gplp.peek("UW", 15), 8);
    Panel gplp_a("autonics-gplp-a");
    gplp_a.expect_refusals(3, {"10 00 50 00 01 02 00 01", "0F 05 0F 00 01 01 01"});  // UW80, UB80F
    gplp_a.expect({{"10 00 51 00 01 02 00 01", "10 00 51 00 01"},                    // UW81
                   {"0F 05 10 00 01 01 01", "0f 05 10 00 01"}});                     // UB810
}

TEST(Station, AnswersProtectedWritesAsTheProfileChooses) {
    profile::PanelProfile chosen = shipped("autonics-gplp-s");
    chosen.simulation.protected_exception = 2;
    for (profile::Area& one : chosen.areas)
        if (one.name == "UW") one.writable->last = 100;
    Panel gplp(chosen, 7);
    gplp.expect_refusals(2, {"10 00 0E 00 01 02 00 01", "0F 00 EF 00 01 01 01",
                             "10 00 64 00 02 04 00 01 00 02"});  // UW100 and UW101
    EXPECT_EQ(gplp.peek("UW", 100), 0);
    EXPECT_EQ(gplp.ask("10 00 64 00 01 02 00 01"), "10 00 64 00 01");
}

TEST(Station, SharesTheMemoryOfWordsAndTheirBits) {
    Panel gplp("autonics-gplp-s");
    gplp.expect({{"03 00 12 00 01", "03 02 00 19"},  // UB180 to UB184 are bits of UW18
                 {"0F 06 40 00 05 01 1A", "0f 06 40 00 05"},
                 {"03 00 64 00 01", "03 02 00 1a"},
                 {"10 00 64 00 01 02 80 01", "10 00 64 00 01"},
                 {"01 06 40 00 10", "01 02 01 80"},
                 {"0F 06 4F 00 01 01 00", "0f 06 4f 00 01"}});
    EXPECT_EQ(gplp.peek("UW", 100), 1) << "the other bits of the word stay";
    gplp.poke("UB", 1601, 1);
    EXPECT_EQ(gplp.peek("UW", 100), 3);
}

profile::Area area(const char* name, Table table, profile::AddressRange readable) {
    profile::Area made;
    made.name = name;
    made.table = table;
    made.readable = readable;
    return made;
}

/// Words whose bits are coils, and coils of their own.
TEST(Station, HasAWordForEachItemButNoneForTheBitsOfWords) {
    profile::PanelProfile profile;
    profile.areas = {area("W", Table::holding_registers, {100, 109}),
                     area("B", Table::coils, {1600, 1759}), area("R", Table::coils, {0, 19})};
    profile.areas[1].view_of = "W";
    Panel panel(profile, 7);
    for (const auto& [name, address] :
         {std::pair("W", 100u), std::pair("W", 109u), std::pair("B", 1759u), std::pair("R", 19u)})
        EXPECT_EQ(panel.peek(name, address), 0) << name << address;
    panel.poke("W", 100, 0xFFFF);
    panel.poke("W", 109, 0x8001);
    panel.poke("R", 3, 0xFF00);
    EXPECT_EQ(panel.peek("W", 100), 0xFFFF);
    EXPECT_EQ(panel.peek("W", 101), 0);
    EXPECT_EQ(panel.peek("W", 109), 0x8001);
    EXPECT_EQ(panel.peek("R", 3), 1) << "anything but 0";
    EXPECT_EQ(panel.peek("R", 2), 0);
    panel.poke("R", 3, 0);
    EXPECT_EQ(panel.peek("R", 3), 0);
    panel.poke("W", 100, 0);
    panel.poke("W", 101, 0x8002);
    EXPECT_EQ(panel.peek("B", 16 * 101 + 1), 1);
    EXPECT_EQ(panel.peek("B", 16 * 101 + 15), 1);
    EXPECT_EQ(panel.peek("B", 16 * 101), 0);
    EXPECT_EQ(panel.peek("B", 16 * 100 + 15), 0);
    panel.poke("W", 102, 0x00F0);
    panel.poke("B", 16 * 102 + 4, 0);
    panel.poke("B", 16 * 102 + 15, 0xFF00);
    EXPECT_EQ(panel.peek("W", 102), 0x80E0);
    EXPECT_EQ(panel.peek("R", 4), 0) << "coils that are no view are apart";
}

TEST(Station, ReadsTheRegistersOfTheGtByBothFunctionsAndKeepsTheTablesOfTheArmApart) {
    Panel("panasonic-gt")
        .expect({{"06 01 FE 12 34", "06 01 fe 12 34"},
                 {"03 01 FE 00 01", "03 02 12 34"},
                 {"04 01 FE 00 01", "04 02 12 34"}});
    Panel("autonics-arm")
        .expect({{"06 00 00 12 34", "06 00 00 12 34"},
                 {"03 00 00 00 01", "03 02 12 34"},
                 {"04 00 00 00 01", "04 02 00 0a"},
                 {"05 00 3F FF 00", "05 00 3f ff 00"},
                 {"02 00 3F 00 01", "02 01 00"},
                 {"03 04 04 00 03", "03 06 00 01 00 02 00 00"},  // 401029 to 401031
                 {"04 00 6C 00 02", "04 04 4e 2d 34 53"}});      // 300109 N, 300110 4S
}

TEST(Station, ExecutesBroadcastsThatTheManualAllowsAndNoOther) {
    Panel gplp("autonics-gplp-s");
    for (const char* ignored : {"03 00 00 00 05", "06 00 64 00 01", "10 00 0E 00 02 04 00 01 00 02",
                                "10 00 64 00 02 02 00 01", ""})
        gplp.tell_all(ignored);
    EXPECT_EQ(gplp.peek("UW", 100), 0);
    EXPECT_EQ(gplp.peek("UW", 15), 0);
    gplp.tell_all("10 00 64 00 01 02 00 7B");
    EXPECT_EQ(gplp.peek("UW", 100), 0x7B);
    gplp.tell_all("0F 06 40 00 01 01 00");
    EXPECT_EQ(gplp.peek("UW", 100), 0x7A);
    Panel gt("panasonic-gt");
    gt.tell_all("06 01 FE 12 34");
    EXPECT_EQ(gt.peek("GDT", 510), 0x1234);
    gt.tell_all("05 01 13 FF 00");
    EXPECT_EQ(gt.peek("GR", 275), 1);
    Panel arm("autonics-arm");
    arm.tell_all("06 00 00 12 34");
    EXPECT_EQ(arm.peek("4", 0), 0) << "the legible pages allow no broadcast";
}

TEST(Station, ShowsTheTimeInTheClockOfTheGtAndRefusesToSetIt) {
    Panel gt("panasonic-gt");
    const std::string shown = "0e 00 03 00 02 00 07 00 15 00 0b 00 1a 00 06";
    EXPECT_EQ(gt.ask("03 23 78 00 07"), "03 " + shown);
    EXPECT_EQ(gt.ask("04 23 78 00 07"), "04 " + shown);
    EXPECT_EQ(gt.ask("03 23 78 00 02", 58s, kWall + 58), "03 04 00 01 00 03") << "it runs";
    EXPECT_EQ(gt.ask("03 23 7D 00 01"), "03 02 00 1a") << "GDT9085: the year's last two digits";
    gt.expect_refusals(3, {"06 23 78 00 00", "10 23 78 00 01 02 00 00"});
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
    for (const auto& [name, profile] : catalogue().all()) {
        Panel panel(profile, 7);
        for (int second = 0; second < 400; ++second) {
            panel.ask("03 FF FF 00 01", Duration(second * 1s));
            for (const auto& motion : profile.simulation.motion) {
                if (motion.kind == Kind::clock) continue;
                const double value = panel.peek(motion.area, motion.address);
                ASSERT_LE(value, motion.high) << name << ' ' << motion.address;
                ASSERT_GE(value, motion.kind == Kind::toggle ? 0 : motion.low)
                    << name << ' ' << motion.address;
            }
        }
    }
}

TEST(Station, KeepsItsMemoryWhenItIsMoved) {
    Station first(shipped("autonics-gplp-s"), 31);
    first.poke("UW", 500, 77);
    const Station second(std::move(first));
    EXPECT_EQ(second.id(), 31);
    EXPECT_EQ(second.peek("UW", 500), 77);
    EXPECT_EQ(second.peek("UW", 4), 50);
}

TEST(Station, OnlyThePanasonicMindsAPauseOfMoreThan24BitTimes) {
    const SerialFormat format{9600, 8, Parity::none, 1};
    const Duration bits24 = Duration(1s) * 24 / 9600;
    const Station gt(shipped("panasonic-gt"), 20);
    EXPECT_FALSE(gt.rejects_gap(bits24, format));
    EXPECT_TRUE(gt.rejects_gap(bits24 + 1us, format));
    EXPECT_FALSE(Station(shipped("autonics-gplp-s"), 31).rejects_gap(1s, format));
}

TEST(Station, IsRecognisedByTheReadsOfItsProfile) {
    int identified = 0;
    for (const auto& [name, profile] : catalogue().all()) {
        Station station(profile, profile.first_station);
        for (const profile::Identification& how : profile.identification) {
            const Bytes reply = station.handle(TimePoint(1h), 0, how.request);
            EXPECT_TRUE(to_hex(reply).starts_with(to_hex(how.reply))) << name << ": " << how.means;
            ++identified;
        }
    }
    EXPECT_GE(identified, 5);
}

TEST(GenericStation, MasksAWordAsTheStandardsExampleAndWritesBeforeItReads) {
    Panel any("generic");
    any.poke("4", 4, 0x12);
    EXPECT_EQ(any.ask("16 00 04 00 F2 00 25"), "16 00 04 00 f2 00 25");
    EXPECT_EQ(any.peek("4", 4), 0x17);  // AP 6.16's own example
    EXPECT_EQ(any.ask("17 00 0E 00 03 00 0E 00 02 04 00 FF 00 01"), "17 06 00 ff 00 01 00 00");
    EXPECT_EQ(any.ask("17 FF FF 00 02 00 0E 00 01 02 00 01"), "97 02");
    for (const unsigned count : {121u, 122u}) {
        Writer out;
        out.u8(0x17).u16(0).u16(1).u16(0).u16(count).u8(2 * count).raw(Bytes(2 * count, 0));
        EXPECT_EQ(any.ask(out.take()), count == 121 ? "17 02 00 00" : "97 03");
    }
}

TEST(GenericStation, ReportsItsStateAndNameAndCountsWhatItAnsweredNormally) {
    Panel any("generic", 9);
    any.expect({{"0B", "0b 00 00 00 00"},
                {"07", "07 00"},
                {"08 00 00 A5 37", "08 00 00 a5 37"},
                {"08 00 01 00 00", "88 01"},
                {"11", "11 09 09 ff 67 65 6e 65 72 69 63"},
                {"03 00 00 00 01", "03 02 00 00"},
                {"03 00 00 00 00", "83 03"},
                {"0B", "0b 00 00 00 04"},
                {"0B", "0b 00 00 00 04"}});
}

TEST(GenericStation, IdentifiesItself) {
    Panel any("generic");
    const std::string vendor = "00 09 70 61 6e 65 6c 67 61 74 65";
    const std::string product = "01 07 67 65 6e 65 72 69 63";
    const std::string revision = "02 09 73 69 6d 75 6c 61 74 65 64";
    const std::string all = any.ask("2B 0E 01 00");
    EXPECT_EQ(all, "2b 0e 01 81 00 00 03 " + vendor + ' ' + product + ' ' + revision);
    EXPECT_TRUE(modbus::answers("2B 0E 01 00"_hex, *from_hex(all)));
    EXPECT_EQ(any.ask("2B 0E 01 02"), "2b 0e 01 81 00 00 01 " + revision);
    EXPECT_EQ(any.ask("2B 0E 01 07"), all) << "an unknown object starts over";
    EXPECT_EQ(any.ask("2B 0E 04 01"), "2b 0e 04 81 00 00 01 " + product);
    any.expect({{"2B 0E 04 03", "ab 02"},
                {"2B 0E 05 00", "ab 03"},
                {"2B 0E 01", "ab 03"},
                {"2B 0D 00", "ab 01"}});
}

TEST(GenericStation, ReachesEveryAddressAndRefusesWhatIsNotSimulatedWith01) {
    Panel any("generic");
    any.expect({{"06 FF FF AB CD", "06 ff ff ab cd"},
                {"03 FF FF 00 01", "03 02 ab cd"},
                {"04 FF FF 00 01", "04 02 00 00"},
                {"05 FF FF FF 00", "05 ff ff ff 00"},
                {"01 FF FF 00 01", "01 01 01"},
                {"02 FF FF 00 01", "02 01 00"},
                {"03 FF FF 00 02", "83 02"}});
    any.expect_refusals(
        1, {"0C", "18 00 04", "14 07 06 00 04 00 01 00 02", "15 09 06 00 04 00 07 00 01 06 AF"});
}

/// Prefix of a vector's name -> the demo panel that it is sent to.
struct Demo {
    const char* prefix;
    const char* profile;
    std::uint8_t id;
};
constexpr Demo kDemos[] = {{"gplp_", "autonics-gplp-s", 31},
                           {"gp2005_", "autonics-gp-2005", 5},
                           {"arm_", "autonics-arm", 17},
                           {"gt_", "panasonic-gt", 20},
                           {"cp2e_", "omron-cp2e", 1}};

const Demo& demo_of(const Vector& v) {
    for (const Demo& demo : kDemos)
        if (v.name().starts_with(demo.prefix)) return demo;
    throw std::logic_error("no panel for " + v.name());
}

/// The frames of the manuals (part 7) whose reply is shown, or not.
std::vector<Vector> vectors_of_panels(bool with_reply) {
    std::vector<Vector> chosen;
    for (Vector& v : load_vectors(TEST_DATA "/vectors.yaml")) {
        const bool wanted = v.text("part") == "7" && v.kind() != "broadcast";
        if (wanted && v.bytes("response").has_value() == with_reply) chosen.push_back(std::move(v));
    }
    return chosen;
}
std::string name_of(const ::testing::TestParamInfo<Vector>& info) { return info.param.name(); }

Bytes pdu_of(const Bytes& adu) { return Bytes(adu.begin() + 1, adu.end() - 2); }

/// The frame with the right CRC: as printed, or as corrected where the print is an erratum.
Bytes good_frame(const Vector& v, const std::string& key) {
    return v.bytes(key + "_corrected").value_or(*v.bytes(key));
}

/// Reply of a fresh panel, `running` after its first request.
Bytes reply_to(const Vector& v, Duration running) {
    Station station(shipped(demo_of(v).profile), demo_of(v).id);
    const TimePoint start{};
    station.handle(start, 0, "03 FF FF 00 01"_hex);
    return station.handle(start + running, 0, pdu_of(good_frame(v, "request")));
}

class FrameOfAManual : public ::testing::TestWithParam<Vector> {};

TEST_P(FrameOfAManual, IsAnsweredByteForByte) {
    const Vector& v = GetParam();
    const Bytes expected = good_frame(v, "response");
    const std::uint8_t station = expected[0];
    for (const Duration running : {Duration(0s), Duration(7s), Duration(3601s)}) {
        const Bytes reply = modbus::encode_adu(station, reply_to(v, running));
        EXPECT_EQ(to_hex(reply), to_hex(expected)) << to_seconds(running) << " s after the start";
    }
}

INSTANTIATE_TEST_SUITE_P(Vectors, FrameOfAManual, ::testing::ValuesIn(vectors_of_panels(true)),
                         name_of);

class FrameWithoutAPrintedReply : public ::testing::TestWithParam<Vector> {};

TEST_P(FrameWithoutAPrintedReply, IsAnsweredAsItsLayoutSays) {
    const Vector& v = GetParam();
    const Bytes request = pdu_of(*v.bytes("request"));
    const Bytes reply = reply_to(v, 1s);
    if (v.name() == "cp2e_fc01_w0_00_to_w127_14") {  // 2047 bits fit no byte count
        EXPECT_EQ(to_hex(reply), "81 03");
        return;
    }
    EXPECT_TRUE(modbus::answers(request, reply)) << to_hex(reply);
    EXPECT_FALSE(modbus::exception_of(reply)) << to_hex(reply);
}

INSTANTIATE_TEST_SUITE_P(Vectors, FrameWithoutAPrintedReply,
                         ::testing::ValuesIn(vectors_of_panels(false)), name_of);

TEST(FramesOfTheManuals, AreAllThere) {
    EXPECT_EQ(vectors_of_panels(true).size(), 21u);
    EXPECT_EQ(vectors_of_panels(false).size(), 11u);
    std::map<std::string, int> panels;
    for (const Vector& v : vectors_of_panels(true)) ++panels[demo_of(v).profile];
    EXPECT_EQ(panels, (std::map<std::string, int>{{"autonics-gplp-s", 5},
                                                  {"autonics-gp-2005", 3},
                                                  {"autonics-arm", 5},
                                                  {"panasonic-gt", 4},
                                                  {"omron-cp2e", 4}}));
}

}  // namespace
}  // namespace panelgate::sim::station_test
