// Timing of lines and stations: inheritance, `auto`, and allowed values.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "memory_files.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::timing_test {
namespace {

/// Loads a line with these keys after its name.
Line line_of(const std::string& text) {
    yaml::Problems problems("f.yaml");
    const std::optional<Config> config =
        load("lines:\n  - name: a\n" + text + "modbus_tcp:\n  - listen: 127.0.0.1:0\n",
             MemoryFiles({}), problems);
    EXPECT_EQ(problems.text(), "");
    return config.value().lines.at(0);
}

TEST(ConfigTiming, P5AFrameGapIsTheOwnersChoiceDownToThreeAndAHalfCharacters) {
    const Line quick = line_of(
        "    device: /dev/ttyS0\n    serial: {baud: 115200, parity: none}\n"
        "    timing: {frame_gap: 304us}\n    stations: [{id: 1}, {id: 2, timing: {frame_gap: "
        "auto}}]\n");
    EXPECT_EQ(quick.arbiter.unlisted.frame_gap, Duration(304us));
    EXPECT_EQ(quick.arbiter.stations[0].frame_gap, Duration(304us));
    EXPECT_EQ(quick.arbiter.stations[1].frame_gap, Duration(1750us));
    const Line slow = line_of(
        "    device: /dev/ttyS0\n    serial: {baud: 9600, parity: none}\n"
        "    timing: {frame_gap: 3646us}\n");
    EXPECT_GE(Duration(3646us), silent_interval(slow.device.serial));
    for (const char* device : {"sim", "tcp://10.0.0.7:4001"}) {
        const Line none =
            line_of(std::string("    device: ") + device + "\n    timing: {frame_gap: 0us}\n");
        EXPECT_EQ(none.arbiter.unlisted.frame_gap, Duration::zero());
    }
}

TEST(ConfigTiming, TheAutomaticReplyHoleFitsTheTransport) {
    const Line tty = line_of("    device: /dev/ttyS0\n    serial: {baud: 9600}\n");
    EXPECT_EQ(tty.arbiter.reply_hole, 60ms + wire_time(tty.device.serial, 32));
    const Line sim = line_of("    device: sim\n    serial: {baud: 9600}\n");
    EXPECT_EQ(sim.arbiter.reply_hole, tty.arbiter.reply_hole);
    const std::string tcp = "    device: tcp://10.0.0.7:4001\n";
    EXPECT_EQ(line_of(tcp).arbiter.reply_hole, Duration(700ms));
    EXPECT_EQ(line_of(tcp + "    timing: {reply_hole: auto}\n").arbiter.reply_hole,
              Duration(700ms));
    EXPECT_EQ(line_of(tcp + "    timing: {reply_hole: 2s}\n").arbiter.reply_hole, Duration(2s));
}

TEST(ConfigTiming, P1OnlyALineOverTcpMayDelayFrames) {
    EXPECT_TRUE(line_of("    device: tcp://10.0.0.7:4001\n").arbiter.may_stall);
    EXPECT_FALSE(line_of("    device: sim\n").arbiter.may_stall);
}

TEST(ConfigTiming, TheConfigurationChoosesWhatPausesAfterATimeout) {
    using arbiter::Quarantine;
    const auto chosen = [](const std::string& word) {
        return line_of("    device: sim\n    quarantine: " + word + "\n").arbiter.quarantine;
    };
    EXPECT_EQ(chosen("auto"), Quarantine::automatic);
    EXPECT_EQ(chosen("line"), Quarantine::line);
    EXPECT_EQ(chosen("station"), Quarantine::station);
}

TEST(ConfigTiming, P6AProfileVouchesForTheLengthOfReadsAndGenericDoesNot) {
    const Line line = line_of(
        "    device: sim\n    serial: {baud: 38400, parity: none}\n"
        "    stations: [{id: 20, profile: panasonic-gt}, {id: 1, profile: generic}, {id: 2}]\n");
    EXPECT_TRUE(line.arbiter.stations[0].vouched);
    EXPECT_FALSE(line.arbiter.stations[1].vouched);
    EXPECT_FALSE(line.arbiter.stations[2].vouched);
    EXPECT_FALSE(line.arbiter.unlisted.vouched);
}

TEST(ConfigTiming, AStationOverridesTheTimingOfItsLine) {
    const Line line =
        line_of(std::string("    device: sim\n    serial: {baud: 38400, parity: none}\n") +
                "    timing: {response_timeout: 1s, late_window: 3s}\n"
                "    retries: 2\n"
                "    stations:\n"
                "      - {id: 1}\n"
                "      - id: 2\n"
                "        retries: 0\n"
                "        retry_writes: true\n"
                "        access: read_only\n"
                "        timing: {response_timeout: 50ms, frame_gap: 3ms,\n"
                "                 late_window: auto}\n");
    const auto& stations = line.arbiter.stations;
    ASSERT_EQ(stations.size(), 2U);
    EXPECT_EQ(stations[0].response_timeout, Duration(1s));
    EXPECT_EQ(stations[0].late_window, Duration(3s));
    EXPECT_EQ(stations[0].retries, 2);
    EXPECT_EQ(stations[0].frame_gap, Duration(1750us));
    EXPECT_EQ(stations[1].response_timeout, Duration(50ms));
    EXPECT_EQ(stations[1].late_window, std::nullopt);
    EXPECT_EQ(stations[1].retries, 0);
    EXPECT_TRUE(stations[1].retry_writes);
    EXPECT_EQ(stations[1].frame_gap, Duration(3ms));
    EXPECT_TRUE(line.stations[0].automatic_gap);
    EXPECT_FALSE(line.stations[1].automatic_gap);
    EXPECT_FALSE(line.stations[0].read_only);
    EXPECT_TRUE(line.stations[1].read_only);
}

TEST(ConfigTiming, TheAutomaticFrameGapIsWhatThePanelAsksOrTheStandardWhicheverIsLonger) {
    // The GT requires 4 characters (ARCT1F501E, 1.1.2): longer than t3.5 only up to 19200 bit/s.
    const std::string gt = "    stations: [{id: 20, profile: panasonic-gt}, {id: 1}]\n";
    const Line slow = line_of("    device: sim\n    serial: {baud: 9600, parity: odd}\n" + gt);
    const SerialFormat& format = slow.device.serial;
    EXPECT_EQ(slow.arbiter.stations[0].frame_gap, 4 * character_time(format));
    EXPECT_EQ(slow.arbiter.stations[1].frame_gap, silent_interval(format));
    const Line fast = line_of("    device: sim\n    serial: {baud: 38400, parity: none}\n" + gt);
    EXPECT_EQ(fast.arbiter.stations[0].frame_gap, Duration(1750us));
    EXPECT_TRUE(fast.stations[0].automatic_gap);
    const Line set = line_of("    device: sim\n    timing: {frame_gap: 5ms}\n" + gt);
    EXPECT_FALSE(set.stations[0].automatic_gap) << "its line says so";
}

}  // namespace
}  // namespace panelgate::config::timing_test
