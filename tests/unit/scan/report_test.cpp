// What a user types to scan and reads of it: options, report, advice.
#include "panelgate/scan/report.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/scan/options.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::scan::report_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST(ScanOptions, AreLists) {
    Settings settings;
    EXPECT_EQ(parse_baud("9600,38400,9600,31250", settings), std::nullopt);
    EXPECT_THAT(settings.baud, ElementsAre(9600, 38400, 31250));
    EXPECT_EQ(parse_parity("even,none", settings), std::nullopt);
    EXPECT_THAT(settings.parity, ElementsAre(Parity::even, Parity::none));
    EXPECT_EQ(parse_stations("5,17,20-22,21", settings), std::nullopt);
    EXPECT_THAT(settings.stations, ElementsAre(5, 17, 20, 21, 22));
    EXPECT_EQ(parse_stations("1-247", settings), std::nullopt);
    EXPECT_EQ(settings.stations.size(), 247u);
}

TEST(ScanOptions, AddressesAreToldAsTheyAreTyped) {
    EXPECT_EQ(station_ranges({}), "");
    EXPECT_EQ(station_ranges({247}), "247");
    for (const char* text : {"1-247", "5,17,20-31", "1-2,4,6-7,246-247"}) {
        const auto list = station_list(text);
        ASSERT_TRUE(list) << text;
        EXPECT_EQ(station_ranges({list->begin(), list->end()}), text);
    }
}

TEST(ScanOptions, SayWhatWouldBeRightAndLeaveTheSettingsAlone) {
    Settings settings;
    settings.stations = {9};
    for (const std::string text :
         {"", "9600,", "fast", "49", "4000001", "9600 38400", "-9600", "9600;1"})
        EXPECT_EQ(
            parse_baud(text, settings),
            "--baud '" + text + "' is not a list of rates from 50 to 4000000 such as 9600,38400");
    EXPECT_EQ(parse_parity("none,mark", settings),
              "--parity 'none,mark' is not a list of none, even and odd");
    for (const std::string text : {"", "0", "248", "31-1", "1-", "-5", "1-31,", "a"})
        EXPECT_EQ(parse_stations(text, settings),
                  "--stations '" + text +
                      "' is not a list of addresses from 1 to 247 such as 1-31 or 5,17,20-31");
    EXPECT_TRUE(settings.baud.empty());
    EXPECT_TRUE(settings.parity.empty());
    EXPECT_THAT(settings.stations, ElementsAre(9));
}

StationFinding finding(std::uint8_t station, std::vector<Candidate> candidates, Evidence seen) {
    StationFinding made;
    made.station = station;
    made.candidates = std::move(candidates);
    made.evidence = seen;
    return made;
}

Result finished(std::vector<StationFinding> stations = {}) {
    Result result;
    result.ending = Result::Ending::finished;
    result.stations = std::move(stations);
    return result;
}

Result four() {
    Result result = finished(
        {finding(5, {{"autonics-gp-2005", "function 04 is refused"}}, {.asked = 12, .good = 12}),
         finding(7, {{"autonics-gplp-s", "x"}}, {.asked = 9, .good = 5, .damaged = 4, .twice = 2}),
         finding(9, {{"panasonic-gt", "a"}, {"omron-cp2e", "b"}},
                 {.asked = 9, .good = 9, .late = 1}),
         finding(20, {}, {.asked = 18, .damaged = 18})});
    result.format = SerialFormat{38400, 8, Parity::none, 1};
    result.stations[1].duplicate = true;
    return result;
}

config::Config loaded(const std::string& text) {
    return config::load_valid(text, config::MemoryFiles({}), "scan.yaml");
}

TEST(ScanReport, IsATable) {
    EXPECT_EQ(report_text("/dev/ttyUSB0", four()),
              "/dev/ttyUSB0: 38400 8N1, 4 stations, 1 address shared by two\n"
              "ADDRESS  PROFILE                     EVIDENCE\n"
              "5        autonics-gp-2005            function 04 is refused\n"
              "7        autonics-gplp-s             two stations seem to share address 7: 4 of 9 "
              "replies overlapped, 2 came twice; x\n"
              "9        panasonic-gt or omron-cp2e  answers late; a\n"
              "20       ?                           18 of 18 replies were damaged\n");
    EXPECT_THAT(report_text("x", four(), "interrupted"),
                StartsWith("x: 38400 8N1, 4 stations, 1 address shared by two (interrupted)\n"));
}

/// Their entries, `name` before each address.
std::string entries(const std::string& name) {
    return "      - {id: 5, name: " + name +
           "-5, profile: autonics-gp-2005}\n"
           "      # two stations seem to share address 7: 4 of 9 replies overlapped, 2 came twice\n"
           "      # (give one of them another address)\n"
           "      - {id: 7, name: " +
           name +
           "-7, profile: autonics-gplp-s}\n"
           "      # answers late\n"
           "      - {id: 9, name: " +
           name +
           "-9, profile: panasonic-gt}  # or omron-cp2e\n"
           "      # 18 of 18 replies were damaged\n"
           "      # - {id: 20, name: " +
           name + "-20, profile: generic}\n";
}

TEST(ScanReport, IsAConfigurationThatLoadsAndTheStationsAloneForALineThatIsThere) {
    EXPECT_EQ(stations_yaml("floor1", four().stations), entries("floor1"));
    EXPECT_EQ(stations_yaml("floor1", {}), "");
    const std::string text = report_yaml("/dev/ttyUSB0", four());
    EXPECT_EQ(text,
              "# found by panelgate scan\n"
              "lines:\n"
              "  - name: line1\n"
              "    device: /dev/ttyUSB0\n"
              "    serial: {baud: 38400, data_bits: 8, parity: none, stop_bits: 1}\n"
              "    stations:\n" +
                  entries("station") +
                  "modbus_tcp:\n"
                  "  - listen: 127.0.0.1:1502\n");
    const config::Line line = loaded(text).lines.at(0);
    EXPECT_EQ(line.stations.size(), 3u);
    EXPECT_EQ(line.device.serial, (SerialFormat{38400, 8, Parity::none, 1}));
}

TEST(ScanReport, SaysWhichPanelHasTheOtherOrderOfTheCrc) {
    Result result = four();
    result.stations.resize(1);
    result.stations[0].crc_order = modbus::CrcOrder::high_first;
    EXPECT_THAT(report_text("x", result),
                HasSubstr("the CRC's high byte comes first; function 04"));
    EXPECT_THAT(report_yaml("/dev/ttyUSB0", result),
                HasSubstr("profile: autonics-gp-2005, crc_order: high_first}"));
}

TEST(ScanReport, SaysWhenThereIsNoTable) {
    Result result = finished();
    EXPECT_EQ(report_text("/dev/x", result), "/dev/x: no station answered\n");
    EXPECT_FALSE(found_any(result));
    result.ending = Result::Ending::another_master;
    result.format = SerialFormat{};
    EXPECT_EQ(report_text("/dev/x", result),
              "/dev/x: another master is talking at 19200 8E1, nothing was asked\n");
    result.remote = true;
    EXPECT_EQ(report_text("tcp://h:1", result),
              "tcp://h:1: another master is talking, nothing was asked\n");
}

TEST(ScanReport, QuotesWhatYamlWouldTakeForSomethingElse) {
    Result result = four();
    result.remote = true;
    for (const std::string device :
         {"tcp://[::1]:4001", "tcp://plc.example:4001", "/dev/serial/by-id/usb-A: \"b\\c\" #1"})
        EXPECT_EQ(loaded(report_yaml(device, result)).lines.at(0).device.device, device);
}

TEST(ScanReport, AdvisesInWholeSentences) {
    EXPECT_THAT(advice("/dev/x", four()), IsEmpty()) << "the table says it all";
    Result result = finished();
    EXPECT_THAT(advice("/dev/x", result), ElementsAre(HasSubstr("--stations 1-247")));
    result.noise = 1;
    result.noisy = true;
    result.talk = {{3, {3, 16}}};
    result.damaged_formats = {SerialFormat{}};
    EXPECT_THAT(
        advice("/dev/x", result),
        ElementsAre(HasSubstr("(station 3 function 3 16): is another master talking?"),
                    HasSubstr("1 byte came"), HasSubstr("wiring, termination"),
                    HasSubstr("something answers at 19200 8E1, and every reply is damaged")));
    EXPECT_THAT(advice("/dev/x", Result{}), IsEmpty()) << "interrupted: not all was asked";
}

}  // namespace
}  // namespace panelgate::scan::report_test
