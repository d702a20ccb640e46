// What the keys of a file come to. Defaults of single keys: unit/explain/every_key_test; faults:
// golden_test.
#include <gmock/gmock.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/yaml/document.hpp"
#include "templates.hpp"

namespace panelgate::config::load_test {
namespace {

using std::tuple;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kSimple = "lines:\n  - name: a\n    device: /dev/ttyS0\n";
const std::string kServe = "modbus_tcp:\n  - listen: 127.0.0.1:0\n";
/// A line at 38400 8N1, to be continued.
const std::string kFast =
    "lines:\n  - name: a\n    device: sim\n    serial: {baud: 38400, parity: none}\n";

/// Returns the problems of a configuration that is not valid.
yaml::Problems problems_of(const std::string& text) {
    yaml::Problems problems("f.yaml");
    EXPECT_FALSE(load(text, MemoryFiles({}), problems));
    return problems;
}

TEST(ConfigLoad, FillsInWhatALineAndAStationDoNotSay) {
    const Config config = load_valid(kSimple + "    stations: [{id: 7}]\n" + kServe);
    EXPECT_EQ(config.lines.at(0).arbiter.echo, EchoMode::automatic);
    const Line& line = config.lines.at(0);
    EXPECT_EQ(line.kind, Line::Kind::serial);
    EXPECT_EQ(line.device.device, "/dev/ttyS0");
    EXPECT_EQ(to_string(line.device.serial), "19200 8E1");
    EXPECT_EQ(line.arbiter.serial, line.device.serial);
    EXPECT_FALSE(line.arbiter.may_stall);
    EXPECT_EQ(line.arbiter.unlisted.response_timeout, 500ms);
    EXPECT_EQ(line.arbiter.unlisted.frame_gap, silent_interval(line.device.serial));
    EXPECT_EQ(line.arbiter.unlisted.late_window, std::nullopt);
    EXPECT_EQ(line.stations.at(0).name, "a-7");
    EXPECT_EQ(line.stations[0].profile->name, "generic");
    const arbiter::StationSettings& settings = line.arbiter.stations.at(0);
    EXPECT_EQ(tuple(settings.id, settings.retry_writes, settings.vouched), tuple(7, false, false));
    EXPECT_EQ(tuple(settings.max_registers, settings.max_bits), tuple(125, 2000));
    EXPECT_THAT(config.warnings, IsEmpty());
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
    EXPECT_EQ(line.arbiter.unlisted.response_timeout, 1s);
    EXPECT_EQ(line.arbiter.unlisted.frame_gap, 5ms);
    EXPECT_EQ(line.arbiter.unlisted.late_window, 700ms);
    EXPECT_EQ(line.arbiter.reply_hole, 120ms);
    EXPECT_EQ(line.arbiter.quarantine, arbiter::Quarantine::line);
    EXPECT_EQ(line.arbiter.unlisted.retries, 4);
    EXPECT_EQ(line.arbiter.broadcast_turnaround, 200ms);
    EXPECT_EQ(line.arbiter.queue, (arbiter::QueueSettings{8, 8, 5s}))
        << "of one client never more than the line's limit";
    EXPECT_EQ(line.arbiter.offline.after, 5);
    EXPECT_EQ(line.arbiter.offline.probe_min, 1min);
    EXPECT_EQ(line.arbiter.offline.probe_max, 2min);
    EXPECT_TRUE(line.refuse_unlisted);
}

TEST(ConfigLoad, MergedReadsStayWithinTheStandardEvenWherePanelsTakeMore) {
    const Config config =
        load_valid(kFast + "    stations: [{id: 20, profile: panasonic-gt}]\n" + kServe);
    EXPECT_EQ(config.lines[0].arbiter.stations[0].max_registers, 125);
    EXPECT_EQ(config.lines[0].arbiter.stations[0].max_bits, 2000);
}

TEST(ConfigLoad, FillsInWhatAListenerDoesNotSay) {
    const Config config = load_valid(kSimple + "modbus_tcp:\n  - {}\nhttp: {}\n");
    const tcp_server::Settings& listener = config.modbus_tcp.at(0);
    EXPECT_THAT(listener.lines, ElementsAre("a"));
    EXPECT_THAT(listener.units, IsEmpty());
    EXPECT_EQ(listener.broadcast, tcp_server::BroadcastMode::reply);
    EXPECT_THAT(listener.allow, IsEmpty());
    EXPECT_THAT(config.http.value().hosts, IsEmpty());
}

TEST(ConfigLoad, ReadsEveryKeyOfAListener) {
    const Config config = load_valid(
        "lines:\n"
        "  - {name: a, device: sim, stations: [{id: 1, name: press}]}\n"
        "  - {name: b, device: sim, stations: [{id: 1, name: oven}]}\n"
        "modbus_tcp:\n"
        "  - listen: '[::1]:1502'\n"
        "    lines: [a, b]\n"
        "    units: {1: a/1, 2: b/oven, 3: a/200, 0: b/0, 101-103: a/1-3}\n"
        "    broadcast: silent\n"
        "    diagnostics_unit: null\n"
        "    access: read_only\n"
        "    allow: [10.0.0.0/8, 192.168.1.7, 'fd00::/8']\n"
        "    max_connections: 3\n"
        "  - listen: 0.0.0.0:1503\n"
        "    lines: [b]\n"
        "    diagnostics_unit: 7\n");
    const tcp_server::Settings& first = config.modbus_tcp.at(0);
    EXPECT_EQ(tuple(first.address, first.port), tuple("::1", 1502));
    EXPECT_THAT(first.lines, ElementsAre("a", "b"));
    const std::map<std::uint8_t, tcp_server::UnitTarget> units{
        {0, {"b", 0}},                                      // everybody on line b
        {1, {"a", 1}},   {2, {"b", 1}},   {3, {"a", 200}},  // unlisted, and the line passes those
        {101, {"a", 1}}, {102, {"a", 2}}, {103, {"a", 3}},
    };
    EXPECT_EQ(first.units, units);
    EXPECT_EQ(first.broadcast, tcp_server::BroadcastMode::silent);
    EXPECT_EQ(first.diagnostics_unit, std::nullopt);
    EXPECT_TRUE(first.read_only);
    ASSERT_EQ(first.allow.size(), 3U);
    EXPECT_EQ(tuple(first.allow[0].prefix, first.allow[1].prefix), tuple(8U, 32U));
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
    EXPECT_EQ(config->http->tokens.at(0).hash, web::hash_of("${BAUD}$$0123456789"));
}

TEST(ConfigLoad, ReadsByWhichNamesAndFromWhereAndWithWhichTokensHttpMayBeAsked) {
    const MemoryFiles files({{"/run/secrets/ops", "\n s3cret \r\n"}});
    const Config config =
        load_valid(kSimple +
                       "http:\n  hosts: [gateway.plant.example, 192.0.2.7, 'fd00::7']\n"
                       "  allow: [10.0.0.0/8, 'fd00::/8']\n  anonymous: none\n"
                       "  tokens: [{name: ops, role: operator, file: /run/secrets/ops}]\n"
                       "log: {level: trace, format: json}\n",
                   files);
    EXPECT_THAT(config.http->hosts, ElementsAre("gateway.plant.example", "192.0.2.7", "fd00::7"));
    ASSERT_EQ(config.http->allow.size(), 2U);
    EXPECT_EQ(config.http->allow[0].address, "10.0.0.0");
    EXPECT_EQ(config.http->allow[0].prefix, 8U);
    EXPECT_EQ(config.http->anonymous, Role::none);
    ASSERT_EQ(config.http->tokens.size(), 1U);
    EXPECT_EQ(config.http->tokens[0].name, "ops");
    EXPECT_EQ(config.http->tokens[0].standing, Role::operator_);
    EXPECT_EQ(config.http->tokens[0].hash, web::hash_of("s3cret"));
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

TEST(ConfigLoad, ARelativeProfilesDirIsBesideTheConfigurationFile) {
    const auto generic =
        RealFiles().read(std::string(SOURCE_ROOT) + "/config/profiles/generic.yaml").value();
    const MemoryFiles files({{"/etc/pg/p/own-panel.yaml", generic},
                             {std::filesystem::absolute("here/p/own-panel.yaml"), generic},
                             {"p/own-panel.yaml", generic},
                             {"/q/own-panel.yaml", generic}});
    const std::string rest =
        kSimple + "    stations: [{id: 1, profile: own-panel}]\n" + kServe + "profiles_dir: ";
    // a text on standard input, or from a pipe, has no folder of its own
    for (const char* file : {"/etc/pg/f.yaml", "here/f.yaml", "f.yaml", "/dev/stdin", "/dev/fd/63",
                             "/proc/self/fd/5"}) {
        EXPECT_EQ(load_valid(rest + "p", files, file).profiles_dir, "p") << file;
        EXPECT_EQ(load_valid(rest + "/q", files, file).profiles_dir, "/q") << file;
    }
    yaml::Problems problems("/etc/pg/f.yaml");
    EXPECT_FALSE(load(kSimple + kServe + "profiles_dir: ../x", files, problems));
    EXPECT_THAT(problems.text(), HasSubstr("cannot list the directory /etc/x"));
}

TEST(ConfigLoad, ARelativeFileIsBesideTheConfigurationFile) {
    const tls::Issued ca = tls::issue_ca("CA", {0, 1});
    const tls::Issued gateway = tls::issue_server(ca, {"gateway"}, {0, 1});
    for (const std::string file : {"/etc/pg/f.yaml", "f.yaml", "/dev/stdin"}) {
        const std::string folder = file.starts_with("/etc") ? "/etc/pg/" : "";
        const MemoryFiles files({{folder + "ops", "token-0123456789ab"},
                                 {folder + "tls/g.crt", gateway.certificate},
                                 {folder + "tls/g.key", gateway.key}});
        const Config config = load_valid(
            kSimple + kServe +
                "http: {tokens: [{name: ops, role: viewer, file: ops}],\n"
                "  tls: {certificate: tls/g.crt, key: tls/g.key}}\n"
                "mqtt: {broker: \"mqtts://b:8883\", username: x, password_file: ops, ca: "
                "tls/g.crt}\n",
            files, file);
        EXPECT_EQ(config.http->tls->key, folder + "tls/g.key");
        EXPECT_EQ(config.mqtt->password, "token-0123456789ab");
    }
}

TEST(ConfigLoad, NothingIsReturnedWhenAnythingIsWrong) {
    EXPECT_EQ(problems_of(kSimple + kServe + "colour: red\n").list().size(), 1U);
}

/// Line floor1 with a press that has these keys.
Config with_press(const std::string& keys) {
    return load_valid(
        "lines:\n  - name: floor1\n    device: sim\n    serial: {baud: 38400, parity: none}\n"
        "    stations:\n      - {id: 31, name: press, profile: autonics-gplp-s, " +
        keys + "}\n" + kServe);
}

TEST(ConfigPoints, AreWhatTheirNotationSays) {
    const Config config = with_press("points: [{name: a, at: UW100}, {name: b, at: UB180}]");
    const Station& press = config.lines[0].stations[0];
    ASSERT_EQ(press.points.size(), 2U);
    const points::Point& word = press.points[0];
    EXPECT_EQ(tuple(word.table, word.address), tuple(modbus::Table::holding_registers, 100));
    EXPECT_EQ(word.type, points::Type::u16);
    const points::Point& bit = press.points[1];
    EXPECT_EQ(tuple(bit.table, bit.address), tuple(modbus::Table::coils, 288));
    EXPECT_EQ(bit.type, points::Type::boolean);
    EXPECT_TRUE(press.polls.empty());
    EXPECT_FALSE(press.guard);
}

TEST(ConfigPoints, ReadsEveryKeyOfAPoint) {
    const Config config = with_press(
        "points: ["
        "{name: t_1-x, at: uw00102, type: i32, word_order: DCBA, scale: 0.5, offset: -3, unit: bar,"
        " min: -1.5, max: 400, writable: true, no_value: [-1, 7], every: 250ms},"
        "{name: mode, at: UW20, labels: {0: off, 10: 'on'}},"
        "{name: recipe, at: UW30, type: string, length: 5},"
        "{name: alarm, at: UW40, bit: 15}]");
    const auto& points = config.lines[0].stations[0].points;
    const points::Point& first = points.at(0);
    EXPECT_EQ(tuple(first.name, first.at, first.unit), tuple("t_1-x", "uw00102", "bar"));
    EXPECT_EQ(tuple(first.address, first.count()), tuple(102, 2U));
    EXPECT_EQ(tuple(first.type, first.word_order),
              tuple(points::Type::i32, points::WordOrder::dcba));
    EXPECT_EQ(tuple(first.scale, first.offset), tuple(0.5, -3.0));
    EXPECT_EQ(first.min, -1.5);
    EXPECT_EQ(first.max, 400);
    EXPECT_TRUE(first.writable);
    EXPECT_EQ(first.no_value, (std::vector<std::int64_t>{-1, 7}));
    EXPECT_EQ(first.every, 250ms);
    EXPECT_EQ(points.at(1).labels, (std::map<std::int64_t, std::string>{{0, "off"}, {10, "on"}}));
    EXPECT_EQ(tuple(points.at(2).length, points.at(2).count()), tuple(5U, 3U));
    EXPECT_EQ(points.at(3).bit, 15U);
    EXPECT_EQ(points.at(3).type, points::Type::boolean);
}

TEST(ConfigPoints, ReadsPollsMaxAgeAndGuard) {
    const Config config = with_press(
        "guard: true, max_age: 2s, poll: [{read: UW0, count: 32, every: 5s}, {read: UB180}]");
    const Station& press = config.lines[0].stations[0];
    EXPECT_TRUE(press.guard);
    EXPECT_EQ(config.lines[0].arbiter.stations[0].max_age, 2s);
    const std::vector<points::Poll> polls{
        {"UW0", modbus::Table::holding_registers, 0, 32, 5s},
        {"UB180", modbus::Table::coils, 288, 1, 1s},
    };
    EXPECT_EQ(press.polls, polls);
}

TEST(ConfigPoints, MorePointsThanTheLimitAreRefusedAtOnce) {
    std::string points;
    for (std::size_t i = 0; i <= points::kMaxPoints; ++i)
        points += "{name: p" + std::to_string(i) + ", at: UW" + std::to_string(i) + "}, ";
    const yaml::Problems problems =
        problems_of(kFast + "    stations:\n      - {id: 1, profile: autonics-gplp-s, points: [" +
                    points + "]}\n" + kServe);
    ASSERT_EQ(problems.list().size(), 1U);
    EXPECT_EQ(problems.list()[0].message, "at most 4096 points, not 4097");
}

std::string with_relays(const std::string& relays) {
    return kSimple + "    stations: [{id: 1, name: a}, {id: 2, name: b}]\nrelays:\n" + relays +
           kServe;
}

std::string relay(const std::string& from, unsigned source, const std::string& to, unsigned target,
                  unsigned count) {
    return "  - {from: " + from + '/' + std::to_string(400001 + source) + ", to: " + to + '/' +
           std::to_string(400001 + target) + ", count: " + std::to_string(count) + "}\n";
}

TEST(ConfigRelays, AreReadWithTheirDefaults) {
    const Config config = load_valid(with_relays(
        relay("a", 100, "b", 200, 8) +
        "  - {from: b/400300, to: a/400400, every: 5s, on_change: true, refresh: 5min}\n"));
    const auto holding = modbus::Table::holding_registers;
    const std::vector<points::Relay> relays{
        {{"a", "400101", holding, 100}, {"b", "400201", holding, 200}, 8, 1s, false, 60s},
        {{"b", "400300", holding, 299}, {"a", "400400", holding, 399}, 1, 5s, true, 5min},
    };
    EXPECT_EQ(config.relays, relays);
    EXPECT_THAT(config.warnings, IsEmpty());
}

TEST(ConfigRelays, RefreshWithoutOnChangeHasNoEffectAndIsReported) {
    const Config config =
        load_valid(with_relays("  - {from: a/400101, to: b/400201, refresh: 5s}\n"));
    EXPECT_THAT(config.warnings,
                ElementsAre(HasSubstr("refresh has no effect without on_change: true")));
    problems_of(with_relays("  - {from: a/400101, to: b/400201, on_change: true, refresh: 5}\n"));
}

TEST(ConfigRelays, AChainMayVisitAStationAgainElsewhere) {
    load_valid(with_relays(relay("a", 0, "b", 0, 8) + relay("b", 0, "a", 100, 8) +
                           relay("a", 100, "b", 100, 8)));
}

/// Layers of three: one copies a block to two places, two merge them again: 2^60 paths.
TEST(ConfigRelays, ManyWaysThroughTheRelaysAreNotWalkedOneByOne) {
    std::string relays;
    for (unsigned layer = 60; layer-- > 0;) {  // backwards, so that each finds the rest
        const unsigned at = layer * 10;
        relays += relay("a", at, "b", at, 2);
        relays += relay("a", at, "b", at + 2, 2);
        relays += relay("b", at, "a", at + 10, 1);
        relays += relay("b", at + 2, "a", at + 11, 1);
    }
    load_valid(with_relays(relays));
}

/// The tree after apply_templates(), and the problems.
struct Applied {
    yaml::Node tree;
    std::string problems;

    /// The only station of the only line.
    const yaml::Node& station() const {
        return tree.entries.at(0).value.items.at(0).entries.at(0).value.items.at(0);
    }
};

Applied apply(const std::string& text) {
    const MemoryFiles files({});
    yaml::Problems problems("f");
    Config config;
    Loading loading{files, problems, config};
    yaml::Node tree = yaml::parse(text, problems);
    apply_templates(loading, tree);
    return {std::move(tree), problems.text()};
}

/// Returns "key=value …" of a map; the length of a list.
std::string text_of(const yaml::Node& map) {
    std::string text;
    for (const yaml::Entry& entry : map.entries) {
        text += (text.empty() ? "" : " ") + entry.key + '=';
        if (entry.value.kind == yaml::Node::Kind::map) {
            text += '{' + text_of(entry.value) + '}';
        } else if (entry.value.kind == yaml::Node::Kind::sequence) {
            text += std::to_string(entry.value.items.size());
        } else {
            text += entry.value.scalar;
        }
    }
    return text;
}

/// What template m gives to a station.
Applied merged(const std::string& given, const std::string& stations) {
    return apply("templates: {m: " + given + "}\nlines: [{stations: [" + stations + "]}]");
}

TEST(ConfigTemplates, GiveWhatTheStationDoesNotSayMapsKeyByKeyAndListsAsAWhole) {
    const auto station_of = [](const std::string& given, const std::string& station) {
        const Applied applied = merged(given, station);
        EXPECT_EQ(applied.problems, "");
        return text_of(applied.station());
    };
    EXPECT_EQ(station_of("{profile: x, guard: true}", "{id: 1, template: m, guard: false}"),
              "id=1 guard=false profile=x");
    EXPECT_EQ(station_of("{timing: {a: 1, b: 2}}", "{template: m, timing: {b: 3}}"),
              "timing={b=3 a=1}");
    EXPECT_EQ(station_of("{points: [1, 2, 3]}", "{template: m, points: [4]}"), "points=1");
    EXPECT_EQ(station_of("{points: [1, 2, 3]}", "{template: m, points: []}"), "points=0");
    EXPECT_EQ(station_of("{points: [1, 2, 3]}", "{template: m}"), "points=3");
}

TEST(ConfigTemplates, KeepTheirMarks) {
    const Applied applied =
        apply("templates:\n  m:\n    profile: x\nlines: [{stations: [{template: m}]}]");
    EXPECT_EQ(applied.station().mark.line, 4);
    EXPECT_EQ(applied.station().entries.at(0).mark.line, 3);
    EXPECT_EQ(applied.station().entries.at(0).value.mark.column, 14);
}

TEST(ConfigTemplates, OfStrangeTreesNothingIsMade) {
    for (const std::string text :
         {"lines: 5", "lines: [5, {stations: 6}, {stations: [7]}]", "[1]", "x", "templates:"})
        EXPECT_EQ(apply(text).problems, "") << text;
}

std::string repeated(const std::string& item, std::size_t times) {
    std::string list = item;
    for (std::size_t i = 1; i < times; ++i) list += ", " + item;
    return list;
}

TEST(ConfigTemplates, WhatTheyGiveInAllIsBounded) {
    const std::string problem = merged("{points: [" + repeated("x", 1000) + "]}",
                                       repeated("{template: m}", 2 * (kMaxTemplateValues / 1000)))
                                    .problems;
    EXPECT_THAT(problem, HasSubstr(": templates give more than 500000 values"));
    EXPECT_EQ(problem.find('\n'), problem.size() - 1) << "once";
    EXPECT_THAT(merged("{unit: " + std::string(1'000'000, 'x') + "}", repeated("{template: m}", 20))
                    .problems,
                HasSubstr("16 MiB of text"));
}

TEST(ConfigShipped, LoadsWithoutAProblemOrAWarning) {
    for (const std::string name : {"demo", "minimal", "panelgate.example"}) {
        const std::string path = std::string(SOURCE_ROOT) + "/config/" + name + ".yaml";
        EXPECT_THAT(load_valid(RealFiles().read(path).value(), RealFiles()).warnings, IsEmpty())
            << name;
    }
}

TEST(ConfigShipped, TheDemoHasTheFivePanelsOfTheContract) {
    const std::string path = std::string(SOURCE_ROOT) + "/config/demo.yaml";
    const Config config = load_valid(RealFiles().read(path).value(), RealFiles());
    const Line& line = config.lines.at(0);
    EXPECT_EQ(tuple(line.name, line.kind), tuple("floor1", Line::Kind::simulated));
    EXPECT_EQ(to_string(line.device.serial), "38400 8N1");
    std::string stations;
    for (const Station& s : line.stations)
        stations += s.name + ' ' + std::to_string(s.id) + ' ' + s.profile->name + '\n';
    EXPECT_EQ(stations,
              "press 31 autonics-gplp-s\nmixer 5 autonics-gp-2005\nio 17 autonics-arm\n"
              "oven 20 panasonic-gt\nfiller 1 omron-cp2e\n");
    EXPECT_EQ(config.modbus_tcp.at(0).name(), "127.0.0.1:1502");
    EXPECT_EQ(config.http->name(), "127.0.0.1:8080");
    EXPECT_EQ(config.http->anonymous, Role::admin);
}

}  // namespace
}  // namespace panelgate::config::load_test
