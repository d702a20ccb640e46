#include "difference.hpp"

#include <gmock/gmock.h>

#include <boost/json/serialize.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::app::difference_test {
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

TEST(Difference, NamesWhatIsInterruptedAlsoByWhatComesOrGoesOnALine) {
    const auto cut = [](const std::string& before, const std::string& after) {
        return interruptions(load(before), load(after));
    };
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

}  // namespace
}  // namespace panelgate::app::difference_test
