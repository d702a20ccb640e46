#include "panelgate/config/weaker.hpp"

#include <gmock/gmock.h>

#include <map>
#include <string>
#include <vector>

#include "memory_files.hpp"

namespace panelgate::config::weaker_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Config loaded(const std::string& text) {
    yaml::Problems problems("x.yaml");
    const MemoryFiles files(std::map<std::string, std::string>{{"/a", "0123456789abcdef0"},
                                                               {"/b", "0123456789abcdef1"}});
    auto config = load(text, files, problems);
    EXPECT_TRUE(config) << problems.text();
    return std::move(config).value();
}

/// Returns what is weaker in `next`; the reverse change must list nothing.
std::vector<std::string> told(const std::string& running, const std::string& next) {
    EXPECT_THAT(weaker(loaded(next), loaded(running)), IsEmpty()) << "the other way round";
    EXPECT_THAT(weaker(loaded(next), loaded(next)), IsEmpty());
    return weaker(loaded(running), loaded(next));
}

std::string plant(const std::string& of_line, const std::string& of_station,
                  const std::string& rest) {
    return "lines:\n  - {name: floor1, device: sim, " + of_line +
           "stations: [{id: 31, name: press" + of_station + "}]}\n" + rest;
}

const std::string kListener = "modbus_tcp: [{listen: '127.0.0.1:1502'}]\n";

std::string station(const std::string& keys) { return plant("", keys, kListener); }
std::string line(const std::string& keys) { return plant(keys, "", kListener); }
std::string endpoint(const std::string& listen, const std::string& keys = "") {
    return plant("", "", "modbus_tcp: [{listen: '" + listen + "'" + keys + "}]\n");
}
std::string http(const std::string& keys, const std::string& listen = "127.0.0.1:8080") {
    return plant("", "", kListener + "http: {listen: '" + listen + "'" + keys + "}\n");
}

TEST(Weaker, AccessAndGuardOfAStation) {
    EXPECT_THAT(told(station(", access: read_only"), station("")),
                ElementsAre("station press: access read_only -> read_write"));
    EXPECT_THAT(told(station(", guard: true"), station("")),
                ElementsAre("station press: guard true -> false"));
}

TEST(Weaker, WhatMayBeWrittenToPoints) {
    const auto point = [](const std::string& keys) {
        return plant("serial: {baud: 38400, parity: none}, ",
                     ", profile: autonics-gplp-s, points: [{name: set, at: UW100" + keys + "}]",
                     kListener);
    };
    EXPECT_THAT(told(point(""), point(", writable: true")),
                ElementsAre("point press/set: is writable"));
    EXPECT_THAT(told(point(", writable: true, max: 50"), point(", writable: true, max: 400")),
                ElementsAre("point press/set: max 50 -> 400"));
    EXPECT_THAT(told(point(", writable: true, min: 5, max: 50"), point(", writable: true")),
                ElementsAre("point press/set: max 50 -> none", "point press/set: min 5 -> none"));
    EXPECT_THAT(told(point(", max: 50"), point(", max: 400")), IsEmpty()) << "never written";
}

TEST(Weaker, AStationThatIsNoLongerListedWhereUnlistedOnesPass) {
    const std::string without =
        "lines: [{name: floor1, device: sim, stations: [{id: 5}]}]\n" + kListener;
    EXPECT_THAT(weaker(loaded(station(", access: read_only")), loaded(without)),
                ElementsAre("station press: is not listed, so nothing is refused for it"));
    EXPECT_THAT(weaker(loaded(station("")), loaded(without)), IsEmpty());
}

TEST(Weaker, UnlistedStationsAndTheModeOfALine) {
    EXPECT_THAT(told(line("unlisted_stations: refuse, "), line("")),
                ElementsAre("line floor1: unlisted_stations refuse -> pass"));
    Config listening = loaded(line(""));
    listening.lines[0].listens = true;
    EXPECT_THAT(weaker(listening, loaded(line(""))),
                ElementsAre("line floor1: mode listen -> ask"));
}

TEST(Weaker, AccessAndBroadcastsOfAListener) {
    EXPECT_THAT(told(endpoint("127.0.0.1:1502", ", access: read_only"), endpoint("127.0.0.1:1502")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: access read_only -> read_write"));
    EXPECT_THAT(told(endpoint("127.0.0.1:1502", ", broadcast: deny"), endpoint("127.0.0.1:1502")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: broadcast deny -> reply"));
    EXPECT_THAT(told(endpoint("127.0.0.1:1502"), endpoint("127.0.0.1:1502", ", udp: true")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: udp false -> true"));
}

TEST(Weaker, AListenerOnAWiderAddressOrAnotherPort) {
    EXPECT_THAT(told(endpoint("127.0.0.1:1502"), endpoint("0.0.0.0:1502")),
                ElementsAre("modbus_tcp 0.0.0.0:1502: is opened"));
    EXPECT_THAT(weaker(loaded(endpoint("127.0.0.1:1502")), loaded(endpoint("127.0.0.1:1503"))),
                ElementsAre("modbus_tcp 127.0.0.1:1503: is opened"));
    EXPECT_THAT(told(http(""), http("", "0.0.0.0:8080")),
                ElementsAre("http 0.0.0.0:8080: is opened"));
    EXPECT_THAT(told(station(""), http("")), ElementsAre("http 127.0.0.1:8080: is opened"));
}

TEST(Weaker, AllowThatLetsMoreIn) {
    const auto allow = [](const std::string& list) {
        return endpoint("127.0.0.1:1502", ", allow: [" + list + "]");
    };
    EXPECT_THAT(told(allow("127.0.0.1/32"), allow("127.0.0.0/8")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: allow lets 127.0.0.0/8 in"));
    EXPECT_THAT(told(allow("127.0.0.1/32"), allow("127.0.0.1/32, 10.0.0.5")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: allow lets 10.0.0.5/32 in"));
    EXPECT_THAT(told(allow("127.0.0.1/32"), endpoint("127.0.0.1:1502")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: allow lets all addresses in"));
    EXPECT_THAT(told(allow("10.0.0.0/8"), allow("'::/0'")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: allow lets ::/0 in"));
    EXPECT_THAT(told(http(", allow: [127.0.0.1/32]"), http("")),
                ElementsAre("http 127.0.0.1:8080: allow lets all addresses in"));
}

TEST(Weaker, HostsThatAreMore) {
    EXPECT_THAT(told(http(", hosts: [a.example]"), http(", hosts: [a.example, b.example]")),
                ElementsAre("http: hosts has b.example"));
    EXPECT_THAT(weaker(loaded(http(", hosts: [a.example]")), loaded(http(""))),
                ElementsAre("http: hosts are all names of this machine"));
}

TEST(Weaker, RolesOfAnonymousClientsAndOfTokens) {
    EXPECT_THAT(told(http(", anonymous: viewer"), http(", anonymous: operator")),
                ElementsAre("http: anonymous viewer -> operator"));
    const auto token = [](const std::string& name, const std::string& role,
                          const std::string& file) {
        return "{name: " + name + ", role: " + role + ", file: " + file + "}";
    };
    const auto tokens = [](const std::string& list) { return http(", tokens: [" + list + "]"); };
    EXPECT_THAT(told(tokens(token("a", "viewer", "/a")), tokens(token("a", "operator", "/a"))),
                ElementsAre("http: token a: role viewer -> operator"));
    EXPECT_THAT(told(tokens(token("a", "viewer", "/a")),
                     tokens(token("a", "viewer", "/a") + ", " + token("b", "viewer", "/b"))),
                ElementsAre("http: token b is valid"));
    EXPECT_THAT(weaker(loaded(tokens(token("a", "viewer", "/a"))),
                       loaded(tokens(token("a", "viewer", "/b")))),
                ElementsAre("http: token a is valid"))
        << "another secret";
}

TEST(Weaker, AListenerThatReachesMore) {
    const auto two = [](const std::string& keys) {
        return "lines: [{name: a, device: sim, stations: [{id: 1}]}, {name: b, device: sim, "
               "stations: [{id: 2}]}]\nmodbus_tcp: [{listen: '127.0.0.1:1502', " +
               keys + "}]\n";
    };
    EXPECT_THAT(told(two("lines: [a]"), two("lines: [a, b]")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: reaches line b"));
    EXPECT_THAT(told(two("lines: [a]"), two("lines: [a], units: {9: b/2}")),
                ElementsAre("modbus_tcp 127.0.0.1:1502: unit 9 is station 2 of b"));
}

TEST(Weaker, WritesOfABroker) {
    const auto mqtt = [](const std::string& keys) {
        return station("") + "mqtt: {broker: 'mqtt://127.0.0.1', topic: a" + keys + "}\n";
    };
    EXPECT_THAT(told(mqtt(""), mqtt(", write: points")), ElementsAre("mqtt: write false -> true"));
}

}  // namespace
}  // namespace panelgate::config::weaker_test
