#include "panelgate/scan/report.hpp"

#include <gmock/gmock.h>

#include "panelgate/config/config.hpp"
#include "panelgate/scan/progress.hpp"

namespace panelgate::scan::report_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

struct NoFiles final : config::Files {
    std::optional<std::string> read(const std::string&) const override { return std::nullopt; }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

StationFinding finding(std::uint8_t station, std::vector<Candidate> candidates, Evidence seen) {
    StationFinding made;
    made.station = station;
    made.candidates = std::move(candidates);
    made.evidence = seen;
    return made;
}

Result five() {
    Result result;
    result.ending = Result::Ending::finished;
    result.format = SerialFormat{38400, 8, Parity::none, 1};
    result.stations.push_back(
        finding(5, {{"autonics-gp-2005", "function 04 is refused"}}, {.asked = 12, .good = 12}));
    result.stations.push_back(
        finding(7, {{"autonics-gplp-s", "x"}}, {.asked = 9, .good = 5, .damaged = 4, .twice = 2}));
    result.stations.back().duplicate = true;
    result.stations.push_back(finding(9, {{"panasonic-gt", "a"}, {"omron-cp2e", "b"}},
                                      {.asked = 9, .good = 9, .late = 1}));
    result.stations.push_back(finding(20, {}, {.asked = 18, .damaged = 18}));
    return result;
}

TEST(ScanReport, IsATable) {
    EXPECT_EQ(report_text("/dev/ttyUSB0", five()),
              "/dev/ttyUSB0: 38400 8N1, 4 stations, 1 address shared by two\n"
              "ADDRESS  PROFILE                     EVIDENCE\n"
              "5        autonics-gp-2005            function 04 is refused\n"
              "7        autonics-gplp-s             two stations seem to share address 7: 4 of 9 "
              "replies overlapped, 2 came twice; x\n"
              "9        panasonic-gt or omron-cp2e  answers late; a\n"
              "20       ?                           18 of 18 replies were damaged\n");
    EXPECT_THAT(report_text("x", five(), "interrupted"),
                StartsWith("x: 38400 8N1, 4 stations, 1 address shared by two (interrupted)\n"));
}

TEST(ScanReport, GivesTheStationsAloneForALineThatIsThere) {
    EXPECT_EQ(stations_yaml("floor1", five().stations),
              "      - {id: 5, name: floor1-5, profile: autonics-gp-2005}\n"
              "      # two stations seem to share address 7: 4 of 9 replies overlapped, 2 came "
              "twice\n"
              "      # (give one of them another address)\n"
              "      - {id: 7, name: floor1-7, profile: autonics-gplp-s}\n"
              "      # answers late\n"
              "      - {id: 9, name: floor1-9, profile: panasonic-gt}  # or omron-cp2e\n"
              "      # 18 of 18 replies were damaged\n"
              "      # - {id: 20, name: floor1-20, profile: generic}\n");
    EXPECT_EQ(stations_yaml("floor1", {}), "");
}

TEST(ScanReport, SaysWhichPanelHasTheOtherOrderOfTheCrc) {
    Result result = five();
    result.stations.resize(1);
    result.stations[0].crc_order = modbus::CrcOrder::high_first;
    EXPECT_THAT(report_text("x", result),
                HasSubstr("the CRC's high byte comes first; function 04"));
    EXPECT_THAT(report_yaml("/dev/ttyUSB0", result),
                HasSubstr("profile: autonics-gp-2005, crc_order: high_first}"));
}

TEST(ScanReport, SaysWhenThereIsNoTable) {
    Result result;
    result.ending = Result::Ending::finished;
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

TEST(ScanReport, IsAConfigurationThatLoads) {
    const std::string text = report_yaml("/dev/ttyUSB0", five());
    EXPECT_EQ(text,
              "# found by panelgate scan\n"
              "lines:\n"
              "  - name: line1\n"
              "    device: /dev/ttyUSB0\n"
              "    serial: {baud: 38400, data_bits: 8, parity: none, stop_bits: 1}\n"
              "    stations:\n"
              "      - {id: 5, name: station-5, profile: autonics-gp-2005}\n"
              "      # two stations seem to share address 7: 4 of 9 replies overlapped, 2 came "
              "twice\n"
              "      # (give one of them another address)\n"
              "      - {id: 7, name: station-7, profile: autonics-gplp-s}\n"
              "      # answers late\n"
              "      - {id: 9, name: station-9, profile: panasonic-gt}  # or omron-cp2e\n"
              "      # 18 of 18 replies were damaged\n"
              "      # - {id: 20, name: station-20, profile: generic}\n"
              "modbus_tcp:\n"
              "  - listen: 127.0.0.1:1502\n");
    yaml::Problems problems("scan.yaml");
    const auto loaded = config::load(text, NoFiles(), problems);
    ASSERT_TRUE(loaded) << problems.text();
    EXPECT_EQ(loaded->lines[0].stations.size(), 3u);
    EXPECT_EQ(loaded->lines[0].device.serial, (SerialFormat{38400, 8, Parity::none, 1}));
}

TEST(ScanReport, QuotesWhatYamlWouldTakeForSomethingElse) {
    Result result = five();
    result.remote = true;
    for (const std::string device :
         {"tcp://[::1]:4001", "tcp://plc.example:4001", "/dev/serial/by-id/usb-A: \"b\\c\" #1"}) {
        const std::string text = report_yaml(device, result);
        yaml::Problems problems("scan.yaml");
        const auto loaded = config::load(text, NoFiles(), problems);
        ASSERT_TRUE(loaded) << problems.text() << text;
        EXPECT_EQ(loaded->lines[0].device.device, device);
    }
}

TEST(ScanReport, AdvisesInWholeSentences) {
    EXPECT_THAT(advice("/dev/x", five()), IsEmpty()) << "the table says it all";
    Result result;
    result.ending = Result::Ending::finished;
    result.noise = 1;
    result.noisy = true;
    result.talk = {{3, {3, 16}}};
    result.damaged_formats = {SerialFormat{}};
    EXPECT_THAT(
        advice("/dev/x", result),
        ElementsAre(HasSubstr("(station 3 function 3 16): is another master talking?"),
                    HasSubstr("1 byte came"), HasSubstr("wiring, termination"),
                    HasSubstr("something answers at 19200 8E1, and every reply is damaged")));
    result = {};
    result.ending = Result::Ending::finished;
    EXPECT_THAT(advice("/dev/x", result), ElementsAre(HasSubstr("--stations 1-247")));
    result.ending = Result::Ending::running;
    EXPECT_THAT(advice("/dev/x", result), IsEmpty()) << "interrupted: not all was asked";
}

TEST(ScanProgress, FitsItsWidth) {
    const Progress progress{0.424, 11200ms, "38400 8N1, station 17", 3};
    EXPECT_EQ(format_progress(progress, 80),
              " 42 %, about 12 s left, 3 found: 38400 8N1, station 17");
    EXPECT_EQ(format_progress(progress, 20), " 42 %, about 12 s le");
    EXPECT_EQ(format_progress({0, 130s, "38400 8N1, listening", 0}, 80),
              "  0 %, at most 3 min left, 0 found: 38400 8N1, listening");
    EXPECT_EQ(format_progress({1, {}, "x", 1}, 80), "100 %, about 0 s left, 1 found: x");
}

}  // namespace
}  // namespace panelgate::scan::report_test
