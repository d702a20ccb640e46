#include "panelgate/config/weaker.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::weaker_test {
namespace {

/// Makes a configuration of the keys that differ.
using Maker = std::function<std::string(const std::string&)>;

Config loaded(const std::string& text) {
    return load_valid(text,
                      MemoryFiles({{"/a", "0123456789abcdef0"}, {"/b", "0123456789abcdef1"}}));
}

std::string joined(const std::vector<std::string>& texts) {
    std::string all;
    for (const std::string& text : texts) all += (all.empty() ? "" : "; ") + text;
    return all;
}

/// Returns what is weaker in the second, whatever the other way round would be.
std::string one_way(const std::string& running, const std::string& next) {
    EXPECT_EQ(joined(weaker(loaded(next), loaded(next))), "");
    return joined(weaker(loaded(running), loaded(next)));
}
/// ... and the reverse change must list nothing.
std::string told(const std::string& running, const std::string& next) {
    EXPECT_EQ(one_way(next, running), "") << "the other way round";
    return one_way(running, next);
}
std::string told(const Maker& made, const std::string& running, const std::string& next) {
    return told(made(running), made(next));
}

std::string plant(const std::string& of_line, const std::string& of_station,
                  const std::string& rest) {
    return "lines:\n  - {name: floor1, device: sim, " + of_line +
           "stations: [{id: 31, name: press" + of_station + "}]}\n" + rest;
}

const std::string kListener = "modbus_tcp: [{listen: '127.0.0.1:1502'}]\n";

std::string station(const std::string& keys) { return plant("", keys, kListener); }
std::string line(const std::string& keys) { return plant(keys, "", kListener); }
std::string at(const std::string& listen) {
    return plant("", "", "modbus_tcp: [{listen: '" + listen + "'}]\n");
}
std::string endpoint(const std::string& keys) {
    return plant("", "", "modbus_tcp: [{listen: '127.0.0.1:1502'" + keys + "}]\n");
}
std::string http_at(const std::string& listen) {
    return plant("", "", kListener + "http: {listen: '" + listen + "'}\n");
}
std::string http(const std::string& keys) {
    return plant("", "", kListener + "http: {listen: '127.0.0.1:8080'" + keys + "}\n");
}

TEST(Weaker, AccessAndGuardOfAStation) {
    EXPECT_EQ(told(station, ", access: read_only", ""),
              "station press: access read_only -> read_write");
    EXPECT_EQ(told(station, ", guard: true", ""), "station press: guard true -> false");
    EXPECT_EQ(one_way(station(", guard: true, profile: omron-cp2e"), station(", guard: true")),
              "station press: guard by profile omron-cp2e -> generic")
        << "which refuses something else";
}

TEST(Weaker, WhatMayBeWrittenToPoints) {
    const Maker point = [](const std::string& keys) {
        return plant("serial: {baud: 38400, parity: none}, ",
                     ", profile: autonics-gplp-s, points: [{name: set, at: UW100" + keys + "}]",
                     kListener);
    };
    EXPECT_EQ(told(point, "", ", writable: true"), "point press/set: is writable");
    EXPECT_EQ(told(point, ", writable: true, max: 50", ", writable: true, max: 400"),
              "point press/set: max 50 -> 400");
    EXPECT_EQ(told(point, ", writable: true, min: 5, max: 50", ", writable: true"),
              "point press/set: max 50 -> none; point press/set: min 5 -> none");
    EXPECT_EQ(told(point, ", max: 50", ", max: 400"), "") << "never written";
    EXPECT_EQ(one_way(point(", writable: true"), point(", writable: true, scale: 0.1")),
              "point press/set: a value is written to another place, or as another number");
}

TEST(Weaker, WritesThatAreRepeated) {
    EXPECT_EQ(told(station, "", ", retry_writes: true"),
              "station press: retry_writes false -> true");
    EXPECT_EQ(told(station, ", retry_writes: true", ", retry_writes: true, retries: 3"),
              "station press: retries 1 -> 3, of writes too");
    EXPECT_EQ(told(station, ", retries: 1", ", retries: 3"), "") << "of reads";
    EXPECT_EQ(told(station, "", ", retry_writes: true, retries: 0"), "");
    EXPECT_EQ(told(station, "", "}, {id: 32, name: oven, retry_writes: true"),
              "station oven: retry_writes false -> true");
}

TEST(Weaker, WhatRelaysWrite) {
    const Maker relays = [](const std::string& list) {
        return "lines: [{name: a, device: sim, stations: [{id: 1, name: one}, {id: 2, name: "
               "two}]}]\n" +
               kListener + "relays: [" + list + "]\n";
    };
    const std::string one = "{from: one/400001, to: two/400101}";
    EXPECT_EQ(told(relays, "", one), "relay one/400001 to two/400101: is added");
    EXPECT_EQ(told(relays, one, "{from: one/400001, to: two/400101, count: 4}"),
              "relay one/400001 to two/400101: count 1 -> 4");
    EXPECT_EQ(one_way(relays(one), relays("{from: one/400002, to: two/400101}")),
              "relay one/400002 to two/400101: is added")
        << "other values";
    EXPECT_EQ(told(relays, one, "{from: one/400001, to: two/400101, every: 5s}"), "");
}

TEST(Weaker, AStationThatIsNoLongerListedWhereUnlistedOnesPass) {
    const std::string without =
        "lines: [{name: floor1, device: sim, stations: [{id: 5}]}]\n" + kListener;
    EXPECT_EQ(one_way(station(", access: read_only"), without),
              "station press: is not listed, so nothing is refused for it");
    EXPECT_EQ(one_way(station(""), without), "");
}

TEST(Weaker, UnlistedStationsAndTheModeOfALine) {
    EXPECT_EQ(told(line, "unlisted_stations: refuse, ", ""),
              "line floor1: unlisted_stations refuse -> pass");
    Config listening = loaded(line(""));
    listening.lines[0].listens = true;
    EXPECT_EQ(joined(weaker(listening, loaded(line("")))), "line floor1: mode listen -> ask");
}

TEST(Weaker, AccessAndBroadcastsOfAListener) {
    EXPECT_EQ(told(endpoint, ", access: read_only", ""),
              "modbus_tcp 127.0.0.1:1502: access read_only -> read_write");
    EXPECT_EQ(told(endpoint, ", broadcast: deny", ""),
              "modbus_tcp 127.0.0.1:1502: broadcast deny -> reply");
    EXPECT_EQ(told(endpoint, "", ", udp: true"), "modbus_tcp 127.0.0.1:1502: udp false -> true");
    EXPECT_EQ(told(endpoint, ", diagnostics_unit: null", ""),
              "modbus_tcp 127.0.0.1:1502: diagnostics_unit null -> 255");
}

TEST(Weaker, AListenerOnAWiderAddressOrAnotherPort) {
    EXPECT_EQ(told(at, "127.0.0.1:1502", "0.0.0.0:1502"), "modbus_tcp 0.0.0.0:1502: is opened");
    EXPECT_EQ(one_way(at("127.0.0.1:1502"), at("127.0.0.1:1503")),
              "modbus_tcp 127.0.0.1:1503: is opened");
    EXPECT_EQ(told(http_at, "127.0.0.1:8080", "0.0.0.0:8080"), "http 0.0.0.0:8080: is opened");
    EXPECT_EQ(told(station(""), http("")), "http 127.0.0.1:8080: is opened");
}

TEST(Weaker, AllowThatLetsMoreIn) {
    const std::string one = ", allow: [127.0.0.1/32]";
    EXPECT_EQ(told(endpoint, one, ", allow: [127.0.0.0/8]"),
              "modbus_tcp 127.0.0.1:1502: allow lets 127.0.0.0/8 in");
    EXPECT_EQ(told(endpoint, one, ", allow: [127.0.0.1/32, 10.0.0.5]"),
              "modbus_tcp 127.0.0.1:1502: allow lets 10.0.0.5/32 in");
    EXPECT_EQ(told(endpoint, one, ""), "modbus_tcp 127.0.0.1:1502: allow lets all addresses in");
    EXPECT_EQ(told(endpoint, ", allow: [10.0.0.0/8]", ", allow: ['::/0']"),
              "modbus_tcp 127.0.0.1:1502: allow lets ::/0 in");
    EXPECT_EQ(told(http, one, ""), "http 127.0.0.1:8080: allow lets all addresses in");
}

TEST(Weaker, PagesOfMoreSitesThatMayRead) {
    EXPECT_EQ(told(http, ", cors: ['http://a.example']",
                   ", cors: ['http://a.example', 'http://b.example:81']"),
              "http: cors has http://b.example:81");
}

TEST(Weaker, HostsThatAreMore) {
    EXPECT_EQ(told(http, ", hosts: [a.example]", ", hosts: [a.example, b.example]"),
              "http: hosts has b.example");
    EXPECT_EQ(one_way(http(", hosts: [a.example]"), http("")),
              "http: hosts are all names of this machine");
}

TEST(Weaker, RolesOfAnonymousClientsAndOfTokens) {
    EXPECT_EQ(told(http, ", anonymous: viewer", ", anonymous: operator"),
              "http: anonymous viewer -> operator");
    const Maker tokens = [](const std::string& list) { return http(", tokens: [" + list + "]"); };
    const std::string a = "{name: a, role: viewer, file: /a}";
    EXPECT_EQ(told(tokens, a, "{name: a, role: operator, file: /a}"),
              "http: token a: role viewer -> operator");
    EXPECT_EQ(told(tokens, a, a + ", {name: b, role: viewer, file: /b}"), "http: token b is valid");
    EXPECT_EQ(one_way(tokens(a), tokens("{name: a, role: viewer, file: /b}")),
              "http: token a is valid")
        << "another secret";
}

TEST(Weaker, ARoleOfTheSameNameThatHasMoreRights) {
    const Maker rights = [](const std::string& list) {
        return http(", anonymous: maint, tokens: [{name: a, role: maint, file: /a}]") +
               "access: {roles: [{name: maint, rights: [" + list + "]}]}\n";
    };
    EXPECT_EQ(told(rights, "read", "read, raw"),
              "http: anonymous maint has more rights; http: token a: role maint has more rights; "
              "access: role maint has more rights");
}

TEST(Weaker, AListenerThatReachesMore) {
    const Maker two = [](const std::string& keys) {
        return "lines: [{name: a, device: sim, stations: [{id: 1}]}, {name: b, device: sim, "
               "stations: [{id: 2}]}]\nmodbus_tcp: [{listen: '127.0.0.1:1502', " +
               keys + "}]\n";
    };
    EXPECT_EQ(told(two, "lines: [a]", "lines: [a, b]"),
              "modbus_tcp 127.0.0.1:1502: reaches line b");
    EXPECT_EQ(told(two, "lines: [a]", "lines: [a], units: {9: b/2}"),
              "modbus_tcp 127.0.0.1:1502: unit 9 is station 2 of b");
    EXPECT_EQ(one_way(two("lines: [a], units: {0: a/1}"), two("lines: [a]")),
              "modbus_tcp 127.0.0.1:1502: unit 0 is a broadcast to all stations");
    EXPECT_EQ(one_way(two("lines: [a], units: {0: a/1}"), two("lines: [a], broadcast: deny")), "");
}

TEST(Weaker, WritesOfABroker) {
    const Maker mqtt = [](const std::string& keys) {
        return station("") + "mqtt: {broker: 'mqtt://127.0.0.1', topic: a" + keys + "}\n";
    };
    EXPECT_EQ(told(mqtt, "", ", write: points"), "mqtt: write false -> true");
}

}  // namespace
}  // namespace panelgate::config::weaker_test
