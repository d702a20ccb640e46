#include "panelgate/explain/difference.hpp"

#include <gmock/gmock.h>

#include <boost/json/serialize.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::explain::difference_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

config::Config load(const std::string& text, std::map<std::string, std::string> files = {}) {
    return config::load_valid(text, config::MemoryFiles(std::move(files)));
}

std::vector<std::string> told(const config::Config& before, const config::Config& after) {
    std::vector<std::string> texts;
    for (const Change& change : differences(before, after)) texts.push_back(to_string(change));
    return texts;
}

std::vector<std::string> told(const std::string& before, const std::string& after) {
    return told(load(before), load(after));
}

/// `of_line` and `stations` are the parts that differ.
std::string plant(const std::string& of_line, const std::string& stations) {
    return "lines:\n  - {name: floor1, device: sim, " + of_line + "stations: [" + stations +
           "]}\nmodbus_tcp: [{listen: '127.0.0.1:1502'}]\n";
}

const std::string kPress = "{id: 31, name: press, poll: [{read: '400001', every: 1s}]}";

TEST(Difference, SaysWhichSettingOfWhatHasAnotherValueAndNothingOfWhatMeansTheSame) {
    EXPECT_THAT(told(plant("", kPress), plant("retries: 1, ", kPress) + "log: {level: info}\n"),
                IsEmpty());
    EXPECT_THAT(told(plant("", kPress),
                     plant("queue: {deadline: 3s}, ",
                           "{id: 32, name: press, poll: [{read: '400001', every: 2s}]}")),
                ElementsAre("lines/floor1/queue: deadline 2s -> 3s",
                            "lines/floor1/stations/press: id 31 -> 32",
                            "lines/floor1/stations/press/poll/400001: every 1s -> 2s"));
}

TEST(Difference, TellsWhatComesOrGoesOnceWithAllThatItHas) {
    const std::string before = plant("", kPress) + "http: {listen: '127.0.0.1:8080'}\n";
    const std::string after =
        "lines:\n  - {name: floor1, device: sim, stations: [" + kPress +
        ", {id: 5, name: mixer, points: [{name: a, at: '400001'}]}]}\n"
        "  - {name: floor2, device: sim, stations: [{id: 7}]}\nmodbus_tcp: [{listen: "
        "'127.0.0.1:1503', lines: [floor1], units: {101: floor1/5}}]\n";
    EXPECT_THAT(
        told(before, after),
        ElementsAre("http: removed", "lines/floor1/stations/mixer: added", "lines/floor2: added",
                    "modbus_tcp/127.0.0.1:1502: removed", "modbus_tcp/127.0.0.1:1503: added"));
}

TEST(Difference, TellsWhatALineHandsDownToItsStationsOnce) {
    const std::string stations = kPress + ", {id: 5, timing: {response_timeout: 300ms}}";
    EXPECT_THAT(told(plant("", stations),
                     plant("timing: {response_timeout: 200ms}, retries: 2, ", stations)),
                ElementsAre("lines/floor1: retries 1 -> 2",
                            "lines/floor1/timing: response_timeout 500ms -> 200ms"));
    const std::string own = "{id: 31, name: press, retries: 2}";
    EXPECT_THAT(told(plant("", "{id: 31, name: press}"), plant("retries: 2, ", own)),
                ElementsAre("lines/floor1: retries 1 -> 2"));
    EXPECT_THAT(told(plant("retries: 2, ", own), plant("retries: 3, ", own)),
                ElementsAre("lines/floor1: retries 2 -> 3"))
        << "the station keeps its own";
}

TEST(Difference, OfAUnitOrALabelIsAddedOrRemovedWithItsValue) {
    const auto listener = [](const std::string& units) {
        return "lines: [{name: a, device: sim, stations: [{id: 1}, {id: 2}]}]\n"
               "modbus_tcp: [{listen: '127.0.0.1:502', units: {" +
               units + "}}]\n";
    };
    EXPECT_THAT(told(listener("101: a/1, 102: a/1"), listener("102: a/2, 103: a/1")),
                ElementsAre("modbus_tcp/127.0.0.1:502/units: 101 removed, was a/1",
                            "modbus_tcp/127.0.0.1:502/units: 102 a/1 -> a/2",
                            "modbus_tcp/127.0.0.1:502/units: 103 added, a/1"));
}

TEST(Difference, KnowsWhatIsNotSetFromEveryWordThatCouldBe) {
    const auto point = [](const std::string& more) {
        return plant("", "{id: 1, name: x, points: [{name: p, at: '400001'" + more + "}]}") +
               "mqtt: {broker: 'mqtt://b:1883', format: sparkplug" +
               (more.empty() ? "" : ", username: none, group: automatic, node: automatic") + "}\n";
    };
    EXPECT_THAT(told(point(""), point(", unit: none, min: 1")),
                ElementsAre("lines/floor1/stations/x/points/p: min not set -> 1",
                            "lines/floor1/stations/x/points/p: unit not set -> none",
                            "mqtt: group not set -> automatic", "mqtt: node not set -> automatic",
                            "mqtt: username not set -> none"));
    const auto changes = differences(load(point(", unit: none")), load(point(", min: 1")));
    ASSERT_EQ(changes.size(), 2U);
    EXPECT_EQ(
        boost::json::serialize(to_json(changes)[1].as_object()),
        R"({"path":"lines/floor1/stations/x/points/p/unit","kind":"changed","before":"none"})");
}

TEST(Difference, OfAKeyThatANeighbourRulesOutIsNotTold) {
    const auto mqtt = [](const std::string& more) {
        return plant("", kPress) + "mqtt: {broker: 'mqtt://b:1883', " + more + "}\n";
    };
    EXPECT_THAT(told(mqtt("qos: 0"), mqtt("format: sparkplug")),
                ElementsAre("mqtt: format json -> sparkplug", "mqtt: qos 0 -> not set"));
    EXPECT_THAT(told(mqtt("qos: 1"), mqtt("format: sparkplug")),
                ElementsAre("mqtt: format json -> sparkplug"));
}

TEST(Difference, OfASecretIsToldAndNeverShown) {
    const std::string text =
        "lines: [{name: a, device: sim}]\nhttp: {tokens: [{name: ops, role: viewer, file: /t}]}\n";
    const auto changes = differences(load(text, {{"/t", "secret-0123456789"}}),
                                     load(text, {{"/t", "other-00123456789"}}));
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(to_string(changes[0]), "http/tokens/ops: secret changed");
    EXPECT_EQ(boost::json::serialize(to_json(changes)),
              R"([{"path":"http/tokens/ops/secret","kind":"changed"}])");
}

TEST(Difference, OfAProfileIsTold) {
    const std::string text =
        "profiles_dir: /p\nlines: [{name: a, device: sim}]\n"
        "modbus_tcp: [{listen: '127.0.0.1:502'}]\n";
    const auto profile = [](const std::string& last) {
        return "description: d\nmanual: m\nstations: {first: 1, last: " + last +
               "}\nfunctions: [{code: 3}]\nareas: [{name: R, description: r, notation: {prefix: "
               "R}, table: holding-registers, readable: [0, 9], source: s}]\n";
    };
    const config::Config before =
        load(text, {{"/p/one.yaml", profile("9")}, {"/p/two.yaml", profile("9")}});
    const config::Config after =
        load(text, {{"/p/one.yaml", profile("8")}, {"/p/three.yaml", profile("9")}});
    EXPECT_THAT(told(before, after), ElementsAre("profiles: one changed", "profiles/three: added",
                                                 "profiles/two: removed"));
}

TEST(Difference, KnowsTwoOfOneNameByTheirOrder) {
    const auto polls = [](const std::string& second) {
        return plant("", "{id: 1, name: x, poll: [{read: '400001'}, {read: '400001', count: " +
                             second + "}]}");
    };
    EXPECT_THAT(told(polls("2"), polls("3")),
                ElementsAre("lines/floor1/stations/x/poll/400001 (2): count 2 -> 3"));
}

TEST(Difference, AsJsonHasPathKindAndBothValues) {
    const auto changes = differences(load(plant("", kPress)), load(plant("retries: 2, ", kPress)));
    EXPECT_EQ(boost::json::serialize(to_json(changes)),
              R"([{"path":"lines/floor1/retries","kind":"changed","before":"1","after":"2"}])");
}

std::vector<std::string> cut(const std::string& before, const std::string& after) {
    std::vector<std::string> texts;
    for (const Interruption& one : interruptions(load(before), load(after)))
        texts.push_back(one.path + ": " + one.what);
    return texts;
}

TEST(Difference, NamesWhatIsInterruptedAlsoByWhatComesOrGoesOnALine) {
    EXPECT_THAT(cut(plant("", kPress), plant("queue: {deadline: 3s}, ", kPress)), IsEmpty());
    const std::string two = kPress + ", {id: 5, name: mixer}";
    const std::string mqtt = "mqtt: {broker: 'mqtt://b:1883'}\n";
    EXPECT_THAT(cut(plant("", kPress) + mqtt, plant("", two) + mqtt),
                ElementsAre("lines/floor1: the port is opened anew",
                            "mqtt: it connects to the broker anew"))
        << "simulated panels are played by the port";
    const auto real = [&](const std::string& stations, const std::string& more = {}) {
        return "lines: [{name: floor1, device: /dev/ttyS1, stations: [" + stations +
               "]}]\nserial_masters: [{name: plc, device: /dev/ttyS2" + more + "}]\n";
    };
    EXPECT_THAT(cut(real(kPress), real(two)), IsEmpty()) << "a master's port stays open";
    EXPECT_THAT(cut(real(kPress), real("{id: 31, name: press, simulate: {dead: true}}")),
                IsEmpty());
    EXPECT_THAT(cut(real(two), real(two, ", units: {7: floor1/5}, broadcast: deny")), IsEmpty());
    EXPECT_THAT(cut(real(two), real(two, ", echo: on")),
                ElementsAre("serial_masters/plc: the port is opened anew"));
}

TEST(Difference, NamesWhatIsInterruptedByWhatIsRemovedRenamedOrElsewhere) {
    const std::string line = "lines: [{name: a, device: /dev/ttyS1, stations: [{id: 1}]}]\n";
    const std::string other = "lines: [{name: b, device: /dev/ttyS1, stations: [{id: 1}]}]\n";
    const std::string modbus = "modbus_tcp: [{listen: '127.0.0.1:502'}]\n";
    const std::string http = "http: {listen: '127.0.0.1:8080'}\n";
    const std::string all = line + "serial_masters: [{name: plc, device: /dev/ttyS2}]\n" + modbus +
                            http + "mqtt: {broker: 'mqtt://b:1883'}\n";
    EXPECT_THAT(
        cut(all, line + http + "realtime: {priority: 1}\n"),
        ElementsAre("serial_masters/plc: the port is closed",
                    "modbus_tcp/127.0.0.1:502: its clients are closed", "mqtt: the session ends"));
    EXPECT_THAT(cut(line + modbus + http, other + "modbus_tcp: [{listen: '127.0.0.1:503'}]\n"),
                ElementsAre("lines/a: the port is closed",
                            "modbus_tcp/127.0.0.1:502: its clients are closed",
                            "http: its clients are closed"));
    EXPECT_THAT(cut(line + modbus, all), IsEmpty()) << "what is added interrupts nobody";
    EXPECT_THAT(cut(line + http, line + http + "realtime: {priority: 1}\n"), IsEmpty());
}

TEST(Difference, NamesAnAllowThatMayCloseClients) {
    const auto with = [](const std::string& allow) {
        return "lines: [{name: a, device: /dev/ttyS1, stations: [{id: 1}]}]\n"
               "modbus_tcp: [{listen: '127.0.0.1:502'" +
               allow + "}]\nhttp: {listen: '127.0.0.1:8080'" + allow + "}\n";
    };
    EXPECT_THAT(cut(with(""), with(", allow: [10.0.0.0/8]")),
                ElementsAre("modbus_tcp/127.0.0.1:502: clients outside `allow` are closed",
                            "http: clients outside `allow` are closed"));
    EXPECT_THAT(cut(with(", allow: [10.0.0.0/8]"), with(", allow: [10.1.0.0/16, 10.2.0.0/16]")),
                testing::SizeIs(2));
    EXPECT_THAT(cut(with(", allow: [10.1.0.0/16]"), with(", allow: [10.0.0.0/8]")), IsEmpty());
    EXPECT_THAT(cut(with(", allow: [10.1.0.0/16]"), with("")), IsEmpty());
}

TEST(Difference, OfTheOrderIsNoneAndInterruptsNothing) {
    const std::string a =
        "  - {name: a, device: sim, stations: [{id: 1, name: x, simulate: {slow: 1ms}, points: "
        "[{name: p, at: '400001'}, {name: q, at: '400002'}]}, {id: 2, name: y}]}\n";
    const std::string turned =
        "  - {name: a, device: sim, stations: [{id: 2, name: y}, {id: 1, name: x, simulate: "
        "{slow: 1ms}, points: [{name: q, at: '400002'}, {name: p, at: '400001'}]}]}\n";
    const std::string b = "  - {name: b, device: sim, stations: [{id: 3, name: a-3}]}\n";
    const std::string rest =
        "mqtt: {broker: 'mqtt://b:1883'}\nmodbus_tcp: [{listen: '127.0.0.1:502'}]\n";
    const std::string before = "lines:\n" + a + b + rest;
    const std::string after = "lines:\n" + b + turned + rest;
    EXPECT_THAT(told(before, after), IsEmpty());
    EXPECT_THAT(cut(before, after), IsEmpty());
}

}  // namespace
}  // namespace panelgate::explain::difference_test
