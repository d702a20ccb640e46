#include <gmock/gmock.h>

#include <array>
#include <optional>
#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/real_files.hpp"

namespace panelgate::config::load_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::string kSimple = "lines:\n  - name: a\n    device: /dev/ttyS0\n";
const std::string kServe = "modbus_tcp:\n  - listen: 127.0.0.1:0\n";
/// A line at 38400 8N1, to be continued.
const std::string kFast =
    "lines:\n  - name: a\n    device: sim\n    serial: {baud: 38400, parity: none}\n";

/// Returns the valid configuration, or fails the test.
Config load_valid(const std::string& text, const Files& files = MemoryFiles({})) {
    yaml::Problems problems("f.yaml");
    std::optional<Config> config = load(text, files, problems);
    EXPECT_EQ(problems.text(), "");
    return std::move(config).value();
}

TEST(ConfigLoad, FillsInTheDefaultsOfALine) {
    const Config config = load_valid(kSimple + kServe);
    ASSERT_EQ(config.lines.size(), 1U);
    const Line& line = config.lines[0];
    EXPECT_EQ(line.kind, Line::Kind::serial);
    EXPECT_EQ(line.device.device, "/dev/ttyS0");
    EXPECT_EQ(to_string(line.device.serial), "19200 8E1");
    EXPECT_EQ(line.arbiter.serial, line.device.serial);
    EXPECT_EQ(line.arbiter.broadcast_turnaround, Duration(100ms));
    EXPECT_EQ(line.arbiter.queue.limit, 256U);
    EXPECT_EQ(line.arbiter.queue.per_client, 32U);
    EXPECT_EQ(line.arbiter.queue.deadline, Duration(2s));
    EXPECT_EQ(line.arbiter.offline.after, 3);
    EXPECT_EQ(line.arbiter.offline.probe_max, Duration(5s));
    EXPECT_EQ(line.arbiter.quarantine, arbiter::Quarantine::automatic);
    EXPECT_FALSE(line.arbiter.may_stall);
    EXPECT_EQ(line.arbiter.unlisted.response_timeout, Duration(500ms));
    EXPECT_EQ(line.arbiter.unlisted.frame_gap, silent_interval(line.device.serial));
    EXPECT_EQ(line.arbiter.unlisted.late_window, std::nullopt);
    EXPECT_EQ(line.arbiter.unlisted.retries, 1);
    EXPECT_FALSE(line.refuse_unlisted);
    EXPECT_THAT(config.warnings, IsEmpty());
}

TEST(ConfigLoad, FillsInTheDefaultsOfAStation) {
    const Config config = load_valid(kSimple + "    stations: [{id: 7}]\n" + kServe);
    const Station& station = config.lines[0].stations.at(0);
    EXPECT_EQ(station.id, 7);
    EXPECT_EQ(station.name, "a-7");
    EXPECT_EQ(station.profile->name, "generic");
    EXPECT_FALSE(station.read_only);
    const arbiter::StationSettings& settings = config.lines[0].arbiter.stations.at(0);
    EXPECT_EQ(settings.id, 7);
    EXPECT_FALSE(settings.retry_writes);
    EXPECT_FALSE(settings.vouched);
    EXPECT_EQ(settings.max_registers, 125);
    EXPECT_EQ(settings.max_bits, 2000);
}

TEST(ConfigLoad, ReadsHowRs485IsSwitched) {
    const Config config = load_valid(
        "lines:\n  - name: a\n    device: /dev/ttyS1\n"
        "    rs485: {mode: kernel, rts_on_send: low, delay_before_send: 1ms, delay_after_send: "
        "2ms,\n"
        "            receive_during_send: true}\n"
        "  - name: b\n    device: /dev/ttyS2\n"
        "    rs485: {mode: rts, delay_before_send: 500us}\n"
        "modbus_tcp: [{listen: \"127.0.0.1:502\", lines: [a]}]\n");
    EXPECT_EQ(config.lines[0].device.rs485,
              (line::Rs485{line::Rs485::Mode::kernel, false, 1ms, 2ms, true}));
    EXPECT_EQ(config.lines[1].device.rs485,
              (line::Rs485{line::Rs485::Mode::rts, true, 500us, 0ms, false}));
}

TEST(ConfigLoad, ReadsEveryKeyOfALine) {
    const Config config = load_valid(
        "lines:\n  - name: hall-2\n    device: sim\n"
        "    serial: {baud: 250000, data_bits: 8, parity: odd, stop_bits: 1}\n"
        "    rs485: {mode: off}\n    echo: off\n    retries: 4\n    unlisted_stations: refuse\n"
        "    timing: {response_timeout: 1s, frame_gap: 5ms, broadcast_turnaround: 200ms,\n"
        "             late_window: 700ms, think_time: 2ms, reply_hole: 120ms}\n"
        "    quarantine: line\n"
        "    queue: {limit: 8, deadline: 5s}\n"
        "    offline: {after: 5, probe_min: 1min, probe_max: 2min}\n" +
        kServe);
    const Line& line = config.lines[0];
    EXPECT_EQ(line.device.rs485, line::Rs485{});
    EXPECT_EQ(line.kind, Line::Kind::simulated);
    EXPECT_EQ(to_string(line.device.serial), "250000 8O1");
    EXPECT_EQ(line.arbiter.unlisted.response_timeout, Duration(1s));
    EXPECT_EQ(line.arbiter.unlisted.frame_gap, Duration(5ms));
    EXPECT_EQ(line.arbiter.unlisted.late_window, Duration(700ms));
    EXPECT_EQ(line.arbiter.reply_hole, Duration(120ms));
    EXPECT_EQ(line.arbiter.quarantine, arbiter::Quarantine::line);
    EXPECT_EQ(line.arbiter.unlisted.retries, 4);
    EXPECT_EQ(line.arbiter.broadcast_turnaround, Duration(200ms));
    EXPECT_EQ(line.arbiter.queue.limit, 8U);
    EXPECT_EQ(line.arbiter.queue.per_client, 8U) << "never more than the line's limit";
    EXPECT_EQ(line.arbiter.queue.deadline, Duration(5s));
    EXPECT_EQ(line.arbiter.offline.after, 5);
    EXPECT_EQ(line.arbiter.offline.probe_min, Duration(1min));
    EXPECT_EQ(line.arbiter.offline.probe_max, Duration(2min));
    EXPECT_TRUE(line.refuse_unlisted);
}

TEST(ConfigLoad, MergedReadsStayWithinTheStandardEvenWherePanelsTakeMore) {
    const Config config =
        load_valid(kFast + "    stations: [{id: 20, profile: panasonic-gt}]\n" + kServe);
    EXPECT_EQ(config.lines[0].arbiter.stations[0].max_registers, 125);
    EXPECT_EQ(config.lines[0].arbiter.stations[0].max_bits, 2000);
}

TEST(ConfigLoad, FillsInTheDefaultsOfTheServers) {
    const Config config = load_valid(kSimple + "modbus_tcp:\n  - {}\nhttp: {}\n");
    const tcp_server::Settings& listener = config.modbus_tcp.at(0);
    EXPECT_EQ(listener.name(), "127.0.0.1:502");
    EXPECT_THAT(listener.lines, ElementsAre("a"));
    EXPECT_THAT(listener.units, IsEmpty());
    EXPECT_EQ(listener.broadcast, tcp_server::BroadcastMode::reply);
    EXPECT_EQ(listener.diagnostics_unit, 255);
    EXPECT_FALSE(listener.read_only);
    EXPECT_THAT(listener.allow, IsEmpty());
    EXPECT_EQ(listener.max_connections, 1024U);
    ASSERT_TRUE(config.http);
    EXPECT_EQ(config.http->name(), "127.0.0.1:8080");
    EXPECT_EQ(config.http->anonymous, web::Role::viewer);
    EXPECT_EQ(config.log.level, rt::LogLevel::info);
    EXPECT_EQ(config.log.format, rt::LogFormat::text);
}

TEST(ConfigLoad, ReadsEveryKeyOfAListener) {
    const Config config = load_valid(
        "lines:\n"
        "  - {name: a, device: sim, stations: [{id: 1, name: press}]}\n"
        "  - {name: b, device: sim, stations: [{id: 1, name: oven}]}\n"
        "modbus_tcp:\n"
        "  - listen: '[::1]:1502'\n"
        "    lines: [a, b]\n"
        "    units: {1: a/1, 2: b/oven, 3: a/200, 0: b/0}\n"
        "    broadcast: silent\n"
        "    diagnostics_unit: null\n"
        "    access: read_only\n"
        "    allow: [10.0.0.0/8, 192.168.1.7, 'fd00::/8']\n"
        "    max_connections: 3\n"
        "  - listen: 0.0.0.0:1503\n"
        "    lines: [b]\n"
        "    diagnostics_unit: 7\n");
    const tcp_server::Settings& first = config.modbus_tcp.at(0);
    EXPECT_EQ(first.address, "::1");
    EXPECT_EQ(first.port, 1502);
    EXPECT_THAT(first.lines, ElementsAre("a", "b"));
    ASSERT_EQ(first.units.size(), 4U);
    EXPECT_EQ(first.units.at(1).line, "a");
    EXPECT_EQ(first.units.at(2).line, "b");
    EXPECT_EQ(first.units.at(2).station, 1);
    EXPECT_EQ(first.units.at(3).station, 200) << "unlisted, and the line passes those";
    EXPECT_EQ(first.units.at(0).station, 0) << "everybody on line b";
    EXPECT_EQ(first.broadcast, tcp_server::BroadcastMode::silent);
    EXPECT_EQ(first.diagnostics_unit, std::nullopt);
    EXPECT_TRUE(first.read_only);
    ASSERT_EQ(first.allow.size(), 3U);
    EXPECT_EQ(first.allow[0].prefix, 8U);
    EXPECT_EQ(first.allow[1].prefix, 32U);
    EXPECT_EQ(first.allow[2].address, "fd00::");
    EXPECT_EQ(first.max_connections, 3U);
    EXPECT_EQ(config.modbus_tcp.at(1).diagnostics_unit, 7);
    EXPECT_FALSE(config.http);
}

TEST(ConfigLoad, ListenersMayAllAskForAFreePort) {
    const Config config = load_valid(kSimple +
                                     "modbus_tcp:\n  - listen: 127.0.0.1:0\n"
                                     "  - listen: 127.0.0.1:0\nhttp: {listen: 127.0.0.1:0}\n");
    EXPECT_EQ(config.modbus_tcp.size(), 2U);
}

TEST(ConfigLoad, TakesNothingFromTheEnvironmentIntoASecret) {
    const MemoryFiles files({{"/run/secrets/ops", "${BAUD}$$0123456789"}});
    yaml::Problems problems("f.yaml");
    const auto config = load(kSimple +
                                 "http: {tokens: [{name: ops, role: operator, file: "
                                 "${DIR}/ops}]}\n",
                             files, problems, [](const std::string& name) {
                                 return name == "DIR" ? "/run/secrets" : "38400";
                             });
    ASSERT_TRUE(config) << problems.text();
    EXPECT_EQ(config->http->tokens.at(0).secret, "${BAUD}$$0123456789");
}

TEST(ConfigLoad, ReadsByWhichNamesAndFromWhereHttpMayBeAsked) {
    const Config config =
        load_valid(kSimple +
                   "http:\n  hosts: [gateway.plant.example, 192.0.2.7, 'fd00::7']\n"
                   "  allow: [10.0.0.0/8, 'fd00::/8']\n");
    EXPECT_THAT(config.http->hosts, ElementsAre("gateway.plant.example", "192.0.2.7", "fd00::7"));
    ASSERT_EQ(config.http->allow.size(), 2U);
    EXPECT_EQ(config.http->allow[0].address, "10.0.0.0");
    EXPECT_EQ(config.http->allow[0].prefix, 8U);
    EXPECT_THAT(load_valid(kSimple + "http: {}\n").http->hosts, IsEmpty());
}

TEST(ConfigLoad, ReadsTokensFromTheirFiles) {
    const MemoryFiles files({{"/run/secrets/ops", "\n s3cret \r\n"}});
    const Config config =
        load_valid(kSimple +
                       "http:\n  anonymous: none\n"
                       "  tokens: [{name: ops, role: operator, file: /run/secrets/ops}]\n"
                       "log: {level: trace, format: json}\n",
                   files);
    EXPECT_EQ(config.http->anonymous, web::Role::none);
    ASSERT_EQ(config.http->tokens.size(), 1U);
    EXPECT_EQ(config.http->tokens[0].name, "ops");
    EXPECT_EQ(config.http->tokens[0].role, web::Role::operator_);
    EXPECT_EQ(config.http->tokens[0].secret, "s3cret");
    EXPECT_EQ(config.log.level, rt::LogLevel::trace);
    EXPECT_EQ(config.log.format, rt::LogFormat::json);
}

TEST(ConfigLoad, AProfilesDirAddsToTheShippedProfilesAndReplacesThem) {
    const auto generic =
        RealFiles().read(std::string(SOURCE_ROOT) + "/config/profiles/generic.yaml").value();
    const MemoryFiles files({{"/p/own-panel.yaml", generic}, {"/p/panasonic-gt.yaml", generic}});
    const Config config = load_valid(
        "profiles_dir: /p\n" + kSimple + "    stations: [{id: 1, profile: own-panel}]\n" + kServe,
        files);
    EXPECT_EQ(config.lines[0].stations[0].profile->name, "own-panel");
    EXPECT_EQ(config.lines[0].stations[0].profile, config.profiles->find("own-panel"));
    ASSERT_NE(config.profiles->find("omron-cp2e"), nullptr);
    EXPECT_EQ(config.profiles->find("panasonic-gt")->areas.size(),
              config.profiles->find("generic")->areas.size());
}

TEST(ConfigLoad, NothingIsReturnedWhenAnythingIsWrong) {
    yaml::Problems problems("f.yaml");
    EXPECT_FALSE(load(kSimple + kServe + "colour: red\n", MemoryFiles({}), problems));
    EXPECT_EQ(problems.list().size(), 1U);
}

class Shipped : public ::testing::TestWithParam<const char*> {};

TEST_P(Shipped, LoadsWithoutAProblemOrAWarning) {
    const std::string path = std::string(SOURCE_ROOT) + "/config/" + GetParam() + ".yaml";
    const Config config = load_valid(RealFiles().read(path).value(), RealFiles());
    EXPECT_THAT(config.warnings, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Files, Shipped, ::testing::Values("demo", "minimal", "panelgate.example"),
    [](const auto& info) {
        return std::string(info.param).substr(0, std::string(info.param).find('.'));
    });

TEST(ShippedDemo, HasTheFivePanelsOfTheContract) {
    const std::string path = std::string(SOURCE_ROOT) + "/config/demo.yaml";
    const Config config = load_valid(RealFiles().read(path).value(), RealFiles());
    const Line& line = config.lines.at(0);
    EXPECT_EQ(line.name, "floor1");
    EXPECT_EQ(line.kind, Line::Kind::simulated);
    EXPECT_EQ(to_string(line.device.serial), "38400 8N1");
    std::string stations;
    for (const Station& s : line.stations)
        stations += s.name + ' ' + std::to_string(s.id) + ' ' + s.profile->name + '\n';
    EXPECT_EQ(stations,
              "press 31 autonics-gplp-s\nmixer 5 autonics-gp-2005\nio 17 autonics-arm\n"
              "oven 20 panasonic-gt\nfiller 1 omron-cp2e\n");
    EXPECT_EQ(config.modbus_tcp.at(0).name(), "127.0.0.1:1502");
    EXPECT_EQ(config.http->name(), "127.0.0.1:8080");
    EXPECT_EQ(config.http->anonymous, web::Role::operator_);
}

}  // namespace
}  // namespace panelgate::config::load_test
