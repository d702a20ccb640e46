// Timing of lines and stations: inheritance, `auto`, allowed values, and what clients may expect.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "memory_files.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/deadlines.hpp"

namespace panelgate::config::timing_test {
namespace {

const std::string kTty = "    device: /dev/ttyS0\n";
const std::string kSim = "    device: sim\n";
const std::string kTcp = "    device: tcp://10.0.0.7:4001\n";
const std::string kFast = "    serial: {baud: 38400, parity: none}\n";

/// Loads a line with these keys after its name.
Line line_of(const std::string& text) {
    return load_valid("lines:\n  - name: a\n" + text + "modbus_tcp:\n  - listen: 127.0.0.1:0\n")
        .lines.at(0);
}

TEST(ConfigTiming, P5AFrameGapIsTheOwnersChoiceDownToThreeAndAHalfCharacters) {
    const Line quick =
        line_of(kTty +
                "    serial: {baud: 115200, parity: none}\n    timing: {frame_gap: 304us}\n"
                "    stations: [{id: 1}, {id: 2, timing: {frame_gap: auto}}]\n");
    EXPECT_EQ(quick.arbiter.unlisted.frame_gap, 304us);
    EXPECT_EQ(quick.arbiter.stations[0].frame_gap, 304us);
    EXPECT_EQ(quick.arbiter.stations[1].frame_gap, 1750us);
    const Line slow =
        line_of(kTty + "    serial: {baud: 9600, parity: none}\n    timing: {frame_gap: 3646us}\n");
    EXPECT_GE(Duration(3646us), silent_interval(slow.device.serial));
    for (const std::string& device : {kSim, kTcp})
        EXPECT_EQ(line_of(device + "    timing: {frame_gap: 0us}\n").arbiter.unlisted.frame_gap,
                  Duration::zero());
}

TEST(ConfigTiming, TheAutomaticReplyHoleFitsTheTransport) {
    const Line tty = line_of(kTty + "    serial: {baud: 9600}\n");
    EXPECT_EQ(tty.arbiter.reply_hole, 60ms + wire_time(tty.device.serial, 32));
    EXPECT_EQ(line_of(kSim + "    serial: {baud: 9600}\n").arbiter.reply_hole,
              tty.arbiter.reply_hole);
    const auto over_tcp = [](const std::string& timing) {
        return line_of(kTcp + timing).arbiter.reply_hole;
    };
    EXPECT_EQ(over_tcp(""), 700ms);
    EXPECT_EQ(over_tcp("    timing: {reply_hole: auto}\n"), 700ms);
    EXPECT_EQ(over_tcp("    timing: {reply_hole: 2s}\n"), 2s);
}

TEST(ConfigTiming, P1OnlyALineOverTcpMayDelayFrames) {
    EXPECT_TRUE(line_of(kTcp).arbiter.may_stall);
    EXPECT_FALSE(line_of(kSim).arbiter.may_stall);
}

TEST(ConfigTiming, TheConfigurationChoosesWhatPausesAfterATimeout) {
    using arbiter::Quarantine;
    const auto chosen = [](const std::string& word) {
        return line_of(kSim + "    quarantine: " + word + "\n").arbiter.quarantine;
    };
    EXPECT_EQ(chosen("auto"), Quarantine::automatic);
    EXPECT_EQ(chosen("line"), Quarantine::line);
    EXPECT_EQ(chosen("station"), Quarantine::station);
}

TEST(ConfigTiming, P6AProfileVouchesForTheLengthOfReadsAndGenericDoesNot) {
    const Line line = line_of(
        kSim + kFast +
        "    stations: [{id: 20, profile: panasonic-gt}, {id: 1, profile: generic}, {id: 2}]\n");
    EXPECT_TRUE(line.arbiter.stations[0].vouched);
    EXPECT_FALSE(line.arbiter.stations[1].vouched);
    EXPECT_FALSE(line.arbiter.stations[2].vouched);
    EXPECT_FALSE(line.arbiter.unlisted.vouched);
}

TEST(ConfigTiming, AStationOverridesTheTimingOfItsLine) {
    const Line line = line_of(
        kSim + kFast +
        "    timing: {response_timeout: 1s, late_window: 3s}\n    retries: 2\n    stations:\n"
        "      - {id: 1}\n"
        "      - {id: 2, retries: 0, retry_writes: true, access: read_only,\n"
        "         timing: {response_timeout: 50ms, frame_gap: 3ms, late_window: auto}}\n");
    ASSERT_EQ(line.arbiter.stations.size(), 2U);
    const arbiter::StationSettings& first = line.arbiter.stations[0];
    EXPECT_EQ(first.response_timeout, 1s);
    EXPECT_EQ(first.late_window, 3s);
    EXPECT_EQ(first.retries, 2);
    EXPECT_EQ(first.frame_gap, 1750us);
    EXPECT_TRUE(line.stations[0].automatic_gap);
    EXPECT_FALSE(line.stations[0].read_only);
    const arbiter::StationSettings& second = line.arbiter.stations[1];
    EXPECT_EQ(second.response_timeout, 50ms);
    EXPECT_EQ(second.late_window, std::nullopt);
    EXPECT_EQ(second.retries, 0);
    EXPECT_TRUE(second.retry_writes);
    EXPECT_EQ(second.frame_gap, 3ms);
    EXPECT_FALSE(line.stations[1].automatic_gap);
    EXPECT_TRUE(line.stations[1].read_only);
}

TEST(ConfigTiming, RestsOfAStationAreThoseOfItsLineUnlessItHasItsOwn) {
    const Line line = line_of(
        kSim + kFast +
        "    timing: {station_gap: 100ms, after_write: 1s}\n    stations:\n"
        "      - {id: 1}\n"
        "      - {id: 2, any_length: true, timing: {station_gap: 850ms, after_write: 0ms}}\n");
    EXPECT_EQ(line.arbiter.unlisted.station_gap, 100ms);
    EXPECT_EQ(line.arbiter.unlisted.after_write, 1s);
    EXPECT_EQ(line.arbiter.stations[0].station_gap, 100ms);
    EXPECT_EQ(line.arbiter.stations[0].after_write, 1s);
    EXPECT_FALSE(line.arbiter.stations[0].any_length);
    EXPECT_EQ(line.arbiter.stations[1].station_gap, 850ms);
    EXPECT_EQ(line.arbiter.stations[1].after_write, Duration::zero());
    EXPECT_TRUE(line.arbiter.stations[1].any_length);
    EXPECT_EQ(line_of(kTcp + "    connect_pause: 1500ms\n").arbiter.connect_pause, 1500ms);
    EXPECT_EQ(line_of(kTcp).arbiter.connect_pause, Duration::zero());
}

TEST(ConfigTiming, TheAutomaticFrameGapIsWhatThePanelAsksOrTheStandardWhicheverIsLonger) {
    // The GT requires 4 characters (ARCT1F501E, 1.1.2): longer than t3.5 only up to 19200 bit/s.
    const std::string gt = "    stations: [{id: 20, profile: panasonic-gt}, {id: 1}]\n";
    const Line slow = line_of(kSim + "    serial: {baud: 9600, parity: odd}\n" + gt);
    const SerialFormat& format = slow.device.serial;
    EXPECT_EQ(slow.arbiter.stations[0].frame_gap, 4 * character_time(format));
    EXPECT_EQ(slow.arbiter.stations[1].frame_gap, silent_interval(format));
    const Line fast = line_of(kSim + kFast + gt);
    EXPECT_EQ(fast.arbiter.stations[0].frame_gap, 1750us);
    EXPECT_TRUE(fast.stations[0].automatic_gap);
    const Line set = line_of(kSim + "    timing: {frame_gap: 5ms}\n" + gt);
    EXPECT_FALSE(set.stations[0].automatic_gap) << "its line says so";
}

Line line_at(int baud, int retries = 1, Duration deadline = 2s) {
    Line line;
    line.device.serial = {baud, 8, Parity::even, 1};
    line.arbiter.unlisted.retries = retries;
    line.arbiter.queue.deadline = deadline;
    return line;
}

TEST(ClientTimeout, IsTheDeadlineByWhichEveryRequestIsAnswered) {
    EXPECT_EQ(client_timeout(line_at(38400)).worst, 2s);
    EXPECT_EQ(client_timeout(line_at(38400, 1, 700ms)).worst, 700ms);
    EXPECT_FALSE(client_timeout(line_at(38400, 1, 450ms)).quick) << "a quick line needs nothing";
}

TEST(ClientTimeout, QuickSettingsLetAllAttemptsOfTheLongestReadFit) {
    for (const int baud : {9600, 19200, 38400, 115200}) {
        for (const int retries : {0, 1, 2}) {
            const Line line = line_at(baud, retries);
            const auto quick = client_timeout(line).quick;
            ASSERT_TRUE(quick) << baud;
            EXPECT_LT(quick->deadline, kQuickClient);
            const Duration request =
                wire_time(line.device.serial, 8) + silent_interval(line.device.serial);
            const Duration reply = wire_time(line.device.serial, 255);
            if (quick->most_registers) continue;
            EXPECT_LE((quick->retries + 1) * (request + quick->response_timeout) + reply,
                      quick->deadline)
                << baud << ", " << retries;
        }
    }
    EXPECT_EQ(client_timeout(line_at(38400)).quick->response_timeout, 180ms);
    EXPECT_EQ(client_timeout(line_at(9600)).quick->retries, 1);
}

TEST(ClientTimeout, ASlowWireTakesShorterReadsOrNone) {
    const auto slow = client_timeout(line_at(2400)).quick;
    ASSERT_TRUE(slow);
    EXPECT_EQ(slow->retries, 0);
    ASSERT_TRUE(slow->most_registers);
    EXPECT_GT(*slow->most_registers, 10u);
    EXPECT_LT(*slow->most_registers, 30u);
    EXPECT_FALSE(client_timeout(line_at(300)).quick) << "not even one register";
}

}  // namespace
}  // namespace panelgate::config::timing_test
