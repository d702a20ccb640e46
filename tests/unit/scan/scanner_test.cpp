// What a scan tries and in which order, and what it finds on a line.
#include "panelgate/scan/scanner.hpp"

#include <gmock/gmock.h>

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "attempt.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/report.hpp"
#include "support/hex.hpp"
#include "virtual_line.hpp"

namespace panelgate::scan::scanner_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const SerialFormat k38400{38400, 8, Parity::none, 1};

std::string texts(const std::vector<SerialFormat>& formats) {
    std::string all;
    for (const SerialFormat& format : formats) all += (all.empty() ? "" : ", ") + to_string(format);
    return all;
}
TEST(LikelyFormats, BeginWithTheProfilesDefaultsThenTheStandardsThenTheUsualOnes) {
    auto formats = likely_formats(shipped(), {});
    ASSERT_EQ(formats.size(), 21u);
    EXPECT_EQ(to_string(formats.back()), "2400 8O1");
    formats.resize(6);
    EXPECT_EQ(texts(formats), "38400 8N1, 9600 8N1, 9600 8E1, 9600 8O1, 19200 8E1, 19200 8N1");
}

TEST(LikelyFormats, AreOnlyWhatTheListsAllow) {
    Settings settings;
    settings.baud = {31250, 9600};
    settings.parity = {Parity::even, Parity::odd};
    EXPECT_EQ(texts(likely_formats(shipped(), settings)),
              "9600 8E1, 9600 8O1, 31250 8E1, 31250 8O1");
    settings.remote = true;
    EXPECT_EQ(likely_formats(shipped(), settings).size(), 1u);
}

TEST(AsciiFormats, AreTheStandardsThenWhatElseIsUsual) {
    const auto formats = ascii_formats({});
    ASSERT_EQ(formats.size(), 16u);
    EXPECT_EQ(texts({formats[0], formats[4], formats[8], formats[12]}),
              "9600 7E1 ASCII, 9600 8N1 ASCII, 9600 7O1 ASCII, 9600 7N2 ASCII");
    Settings settings;
    settings.baud = {9600};
    settings.parity = {Parity::even};
    EXPECT_EQ(texts(ascii_formats(settings)), "9600 7E1 ASCII");
    settings.remote = true;
    EXPECT_EQ(ascii_formats(settings).size(), 1u);
}

TEST(LikelyStations, BeginWithTheEndsOfTheProfilesRanges) {
    auto usual = likely_stations(shipped(), {});
    EXPECT_EQ(usual.size(), 31u);
    usual.resize(4);
    EXPECT_THAT(usual, ElementsAre(1, 31, 2, 3));
    Settings settings;
    settings.stations = {5, 99, 100};
    EXPECT_THAT(likely_stations(shipped(), settings), ElementsAre(99, 5, 100));
}

TEST(SearchTurns, TryAFewStationsInEveryFormatBeforeTheyTryMore) {
    Settings settings;
    settings.baud = {9600};
    settings.parity = {Parity::none, Parity::even};
    settings.stations = {2, 3, 4, 5, 6};
    const auto turns = search_turns(shipped(), settings);
    std::string order;  // '|': the last of its format
    for (const Turn& turn : turns) {
        if (order.size() > 36) break;
        order += (turn.format.parity == Parity::none ? " n" : " e") + std::to_string(turn.station);
        order += turn.timeout == settings.leave_timeout ? "|" : "";
    }
    EXPECT_TRUE(order.starts_with(" n2 n3 n4 n5| e2 e3 e4 e5| n6| e6|")) << order;
}

/// "31 autonics-gplp-s"; several candidates are joined by '|', a duplicate address ends in '!'.
std::string texts(const Result& result) {
    std::string all;
    for (const StationFinding& finding : result.stations) {
        all += (all.empty() ? "" : ", ") + std::to_string(finding.station);
        for (std::size_t i = 0; i < finding.candidates.size(); ++i)
            all += (i == 0 ? " " : "|") + finding.candidates[i].profile;
        all += finding.duplicate ? "!" : "";
    }
    return all;
}

/// The five panels of the demo.
struct DemoLine : VirtualLine {
    explicit DemoLine(const SerialFormat& format = k38400) : VirtualLine(format) {
        add("autonics-gplp-s", 31);
        add("autonics-gp-2005", 5);
        add("autonics-arm", 17);
        add("panasonic-gt", 20);
        add("omron-cp2e", 1);
    }
};

const std::string kDemo =
    "1 omron-cp2e, 5 autonics-gp-2005, 17 autonics-arm, 20 panasonic-gt, 31 autonics-gplp-s";

TEST(Scanner, FindsTheFivePanelsOfTheDemo) {
    DemoLine line;
    const Result result = line.scan({});
    EXPECT_EQ(result.ending, Result::Ending::finished);
    EXPECT_EQ(result.format, k38400);
    EXPECT_EQ(texts(result), kDemo);
    EXPECT_TRUE(result.talk.empty());
    EXPECT_FALSE(result.noisy);
    EXPECT_LT(line.now - line.start, 30s);
}

TEST(Scanner, QuickFindsTheSamePanelsInAThirdOfTheTime) {
    DemoLine usual;
    DemoLine line;
    Settings settings;
    settings.quick = true;
    EXPECT_EQ(texts(line.scan(settings)), kDemo);
    usual.scan({});
    EXPECT_LT(3 * (line.now - line.start), usual.now - usual.start);
}

TEST(Scanner, QuickHearsTheSlowPanelThatItAsksLast) {
    VirtualLine line;
    line.add("omron-cp2e", 1);
    line.add("autonics-gplp-s", 5).slow = 300ms;
    Settings settings;
    settings.quick = true;
    settings.stations = {1, 5};
    EXPECT_EQ(line.scan(settings).stations.size(), 2U);
}

TEST(Scanner, TellsOfPanelsAsSoonAsTheyAreKnown) {
    DemoLine line;
    Scanner scanner(shipped(), {}, line.start);
    std::size_t known = 0;
    for (Duration gone = 100ms; !scanner.done(); gone += 100ms) {
        line.run(scanner, line.start + gone);
        if (known == 0 && scanner.examined().size() == 1)
            EXPECT_THAT(found_text(scanner.examined()[0]), HasSubstr("station 1: omron-cp2e, "));
        EXPECT_GE(scanner.examined().size(), known);
        known = scanner.examined().size();
        if (known == 5) break;
    }
    EXPECT_EQ(known, 5U);
    EXPECT_FALSE(scanner.done());
}

TEST(Scanner, ReportsAnAddressThatTwoPanelsShareAndStillTellsThePanel) {
    for (const char* profile : {"autonics-gplp-s", "panasonic-gt", "autonics-arm"}) {
        DemoLine line;
        line.add(profile, 7).duplicate = 1;
        const Result result = line.scan({});
        EXPECT_THAT(texts(result), HasSubstr(std::string(", 7 ") + profile + "!,"));
        EXPECT_EQ(result.stations.size(), 6u);
        EXPECT_LT(line.now - line.start, 60s);
        EXPECT_FALSE(result.noisy);
        EXPECT_TRUE(result.talk.empty());
    }
    VirtualLine alone;
    alone.add("autonics-gplp-s", 1).duplicate = 1;
    EXPECT_EQ(texts(alone.scan({})), "1 autonics-gplp-s!");
}

TEST(Scanner, ReportsItWheneverTheTwoHappenToSpeak) {
    int recognised = 0;
    constexpr int kRuns = 200;
    for (int run = 0; run < kRuns; ++run) {
        VirtualLine line;
        line.seed(static_cast<unsigned>(run));
        line.add("omron-cp2e", 1);
        line.add("autonics-gplp-s", 7).duplicate = 1;
        const Result found = line.scan({});
        ASSERT_EQ(found.stations.size(), 2u) << run;
        EXPECT_TRUE(texts(found).starts_with("1 omron-cp2e, ")) << run;
        EXPECT_TRUE(found.stations[1].duplicate) << run << ": " << texts(found);
        recognised += texts(found).ends_with(", 7 autonics-gplp-s!") ? 1 : 0;
    }
    EXPECT_GE(recognised, kRuns * 95 / 100);
}

TEST(Scanner, TakesDamageAllOverTheLineForNoise) {
    VirtualLine line;
    for (const std::uint8_t station : Bytes{2, 3, 4, 9})
        line.add("autonics-gplp-s", station).damage = 0.4;
    const Result result = line.scan({});
    EXPECT_TRUE(result.noisy);
    EXPECT_EQ(result.stations.size(), 4u);
    EXPECT_EQ(texts(result).find('!'), std::string::npos) << texts(result);
}

TEST(Scanner, FindsTheFormatWhateverItIs) {
    for (const SerialFormat& format :
         {SerialFormat{9600, 8, Parity::even, 1}, SerialFormat{9600, 8, Parity::odd, 1},
          SerialFormat{115200, 8, Parity::even, 1}, SerialFormat{2400, 8, Parity::odd, 1}}) {
        VirtualLine line(format);
        line.add("panasonic-gt", 20);
        line.add("omron-cp2e", 3);
        const Result result = line.scan({});
        EXPECT_EQ(result.format, format);
        EXPECT_EQ(result.stations.size(), 2u);
        EXPECT_LT(line.now - line.start, 90s) << to_string(format);
    }
}

TEST(Scanner, FindsPanelsThatSpeakAsciiWhenRtuHasFoundNobody) {
    for (const SerialFormat& format : {SerialFormat{19200, 7, Parity::even, 1, SerialMode::ascii},
                                       SerialFormat{9600, 8, Parity::none, 1, SerialMode::ascii}}) {
        VirtualLine line(format);
        line.add("autonics-gplp-s", 31);
        line.add("omron-cp2e", 1).damage = 0.2;
        Settings settings;
        settings.stations = {1, 31};
        settings.baud = {9600, 19200};
        const Result result = line.scan(settings);
        EXPECT_EQ(result.format, format);
        EXPECT_EQ(texts(result), "1 omron-cp2e, 31 autonics-gplp-s");
        EXPECT_THAT(report_yaml("/dev/ttyUSB0", result),
                    HasSubstr("serial: {mode: ascii, baud: " + std::to_string(format.baud)));
    }
}

TEST(Scanner, AsksARemoteDeviceInBothModesAndLeavesItsFormatToIt) {
    VirtualLine line;
    line.add("autonics-gplp-s", 31);
    line.set_panel_mode(SerialMode::ascii);
    Settings settings;
    settings.remote = true;
    settings.stations = {31};
    const Result result = line.scan(settings);
    EXPECT_TRUE(line.formats.empty());
    EXPECT_EQ(texts(result), "31 autonics-gplp-s");
    ASSERT_TRUE(result.format);
    EXPECT_EQ(to_string(*result.format), "38400 7E1 ASCII");
    DemoLine demo({19200, 8, Parity::even, 1});
    settings.stations.clear();
    const Result rtu = demo.scan(settings);
    EXPECT_EQ(texts(rtu), kDemo);
    EXPECT_TRUE(demo.formats.empty());
    EXPECT_EQ(rtu.format, k38400) << "all of them allow it";
}

TEST(Scanner, TriesTheOtherParitiesWhenRepliesAreDamaged) {
    VirtualLine line({57600, 8, Parity::even, 1});
    line.add("panasonic-gt", 1);
    line.garble_other_parities();
    const Result result = line.scan({});
    EXPECT_EQ(result.format, (SerialFormat{57600, 8, Parity::even, 1}));
    EXPECT_EQ(texts(result), "1 panasonic-gt");
}

TEST(Scanner, TellsAPanelOfTheOtherCrcOrderBesideOthersAndAlone) {
    VirtualLine line;
    line.add("autonics-gplp-s", 31);
    line.add("autonics-gp-2005-old", 5);
    line.add("autonics-gp-2005", 6);
    const Result result = line.scan({});
    EXPECT_EQ(texts(result), "5 autonics-gp-2005-old, 6 autonics-gp-2005, 31 autonics-gplp-s");
    EXPECT_EQ(result.stations.at(0).crc_order, modbus::CrcOrder::high_first);
    EXPECT_EQ(result.stations.at(1).crc_order, modbus::CrcOrder::low_first);
    EXPECT_TRUE(result.talk.empty());
    EXPECT_LT(line.now - line.start, 30s);
    for (const bool remote : {false, true}) {
        VirtualLine alone(remote ? SerialFormat{} : k38400);
        alone.add("autonics-gp-2005-old", 9);
        Settings settings;
        settings.remote = remote;
        EXPECT_EQ(texts(alone.scan(settings)), "9 autonics-gp-2005-old") << remote;
    }
}

TEST(Scanner, TriesTheOtherCrcOrderOnlyWhereAProfileHasIt) {
    VirtualLine line({9600, 8, Parity::none, 1});
    line.add("autonics-arm", 17);
    line.scan({});
    for (const Bytes& adu : line.sent) EXPECT_TRUE(modbus::crc_ok(adu));
}

TEST(Scanner, KeepsToTheStationsAndFormatsItWasGiven) {
    DemoLine line;
    Settings settings;
    settings.baud = {38400};
    settings.parity = {Parity::none};
    settings.stations = {5, 17, 40};
    EXPECT_EQ(texts(line.scan(settings)), "5 autonics-gp-2005, 17 autonics-arm");
    for (const Bytes& adu : line.sent) EXPECT_TRUE(adu[0] == 5 || adu[0] == 17 || adu[0] == 40);
    EXPECT_THAT(line.formats, ElementsAre(k38400));
}

TEST(Scanner, SaysNothingWhileAnotherMasterTalks) {
    DemoLine line;
    line.add_foreign(300ms, modbus::encode_adu(17, "03 00 00 00 05"_hex));
    line.add_foreign(310ms, modbus::encode_adu(17, "03 0A 00 01 00 02 00 03 00 04 00 05"_hex));
    const Result result = line.scan({});
    EXPECT_EQ(result.ending, Result::Ending::another_master);
    EXPECT_TRUE(line.sent.empty());
    EXPECT_EQ(result.talk, (Talk{{17, {3}}}));
    EXPECT_EQ(result.format, k38400);
    EXPECT_THAT(advice("/dev/x", result).at(0), HasSubstr("(station 17 function 3): stop it"));
}

TEST(Scanner, FindsTheFormatInWhichAnotherMasterTalks) {
    VirtualLine line({19200, 8, Parity::even, 1});
    for (int i = 0; i < 300; ++i)
        line.add_foreign(i * 100ms, modbus::encode_adu(2, "03 00 00 00 05"_hex));
    const Result result = line.scan({});
    EXPECT_EQ(result.ending, Result::Ending::another_master);
    EXPECT_EQ(result.format, (SerialFormat{19200, 8, Parity::even, 1}));
    EXPECT_TRUE(line.sent.empty());
}

TEST(Scanner, ScansAllTheSameWhenToldAndReportsWhatAnswersNothingItHasAsked) {
    DemoLine line;
    line.add_foreign(300ms, modbus::encode_adu(9, "03 00 00 00 05"_hex));
    Settings settings;
    settings.speak_anyway = true;
    const Result result = line.scan(settings);
    EXPECT_EQ(texts(result), kDemo);
    EXPECT_EQ(result.talk, (Talk{{9, {3}}}));
    DemoLine later;
    for (int i = 0; i < 5; ++i)
        later.add_foreign(1500ms + i * 3s, modbus::encode_adu(200, "06 00 01 00 02"_hex));
    const Result heard = later.scan({});
    EXPECT_EQ(texts(heard), kDemo);
    EXPECT_EQ(heard.talk, (Talk{{200, {6}}}));
}

TEST(Scanner, IsStoppedNeitherByNoiseNorByAnAdaptersEcho) {
    DemoLine line;
    std::mt19937 chance(5);
    for (int i = 0; i < 400; ++i)
        line.add_foreign(i * 37ms, Bytes{static_cast<std::uint8_t>(chance())});
    const Result result = line.scan({});
    EXPECT_EQ(texts(result), kDemo);
    EXPECT_GT(result.noise, 10u);
    DemoLine echoed;
    echoed.echo();
    EXPECT_EQ(texts(echoed.scan({})), kDemo);
}

TEST(Scanner, FindsSlowPanelsByTheirLateRepliesAndTakesNoneForASecondPanel) {
    VirtualLine line;
    line.add("autonics-gplp-s", 1).slow = 150ms;
    line.add("autonics-gplp-a", 3).slow = 400ms;
    const Result result = line.scan({});
    EXPECT_EQ(texts(result), "1 autonics-gplp-s, 3 autonics-gplp-a");
    EXPECT_TRUE(result.talk.empty());
    VirtualLine other;
    sim::Misbehaviour& faults = other.add("autonics-gplp-s", 4);
    faults.late = 0.4;
    faults.late_by = 505ms;
    const Result late = other.scan({});
    EXPECT_EQ(texts(late), "4 autonics-gplp-s");
    EXPECT_GT(late.stations.at(0).evidence.late, 0u);
}

TEST(Scanner, EndsWhenNothingAnswers) {
    VirtualLine line;
    const Result result = line.scan({});
    EXPECT_EQ(result.ending, Result::Ending::finished);
    EXPECT_TRUE(result.stations.empty());
    EXPECT_EQ(line.sent.size(), 21u * 31u + 31u + 16u * 31u)
        << "and once in the other order of the CRC, and in ASCII";
    EXPECT_LT(line.now - line.start, 2min);
}

TEST(Scanner, SendsOnlyReadsWhateverAProfileAsksFor) {
    profile::Catalogue profiles = shipped();
    profile::PanelProfile hostile = *shipped().find("omron-cp2e");
    hostile.name = "hostile";
    for (const auto& request :
         {"06 00 01 00 02"_hex, "10 00 01 00 01 02 00 05"_hex, "08 00 04 00 00"_hex,
          "16 00 01 00 00 00 05"_hex, "03 00"_hex, "2B 0D 01 00"_hex, ""_hex})
        hostile.identification.push_back({request, "06"_hex, "it can be written to", "nowhere"});
    profiles.add(hostile);
    DemoLine line;
    line.scan({}, profiles);
    EXPECT_GT(line.sent.size(), 100u);
    for (const Bytes& adu : line.sent) {
        const ByteView pdu = ByteView(adu).subspan(1, adu.size() - 3);
        EXPECT_TRUE(modbus::is_pure_read(pdu) &&
                    modbus::check_request(pdu, modbus::QuantityCheck::wide))
            << to_hex(adu);
        EXPECT_GE(adu[0], 1);
    }
}

TEST(ReadRequest, CanBeMadeOfReadsOnly) {
    for (int function = 0; function < 256; ++function) {
        const Bytes pdu{static_cast<std::uint8_t>(function), 0, 0, 0, 1};
        const bool read = function >= 1 && function <= 4;
        EXPECT_EQ(ReadRequest::make(7, pdu).has_value(), read) << function;
    }
    EXPECT_FALSE(ReadRequest::make(0, "03 00 00 00 01"_hex)) << "a broadcast";
    EXPECT_FALSE(ReadRequest::make(248, "03 00 00 00 01"_hex));
    EXPECT_EQ(ReadRequest::make(7, "03 00 00 00 01"_hex)->pdu().size(), 5u);
}

TEST(Scanner, MayBePokedAtAnyTime) {
    DemoLine line;
    Scanner scanner(shipped(), {}, line.start);
    for (int i = 0; i < 20'000 && !scanner.done(); ++i) {
        line.run(scanner, line.start + i * 3ms);
        scanner.on_deadline(line.start + i * 3ms - 1ms);
    }
    EXPECT_TRUE(scanner.done());
    EXPECT_EQ(texts(scanner.result()), kDemo);
}

TEST(Scanner, TellsWhatItKnowsBeforeItIsDone) {
    DemoLine line;
    Scanner scanner(shipped(), {}, line.start);
    line.run(scanner, line.start + 1500ms);
    EXPECT_EQ(scanner.result().ending, Result::Ending::running);
    EXPECT_FALSE(scanner.result().stations.empty());
    EXPECT_THAT(scanner.progress(), HasSubstr(" found, "));
    EXPECT_THAT(scanner.progress(), HasSubstr("38400 8N1, "));
}

}  // namespace
}  // namespace panelgate::scan::scanner_test
