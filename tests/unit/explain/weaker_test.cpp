#include "panelgate/explain/difference.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::explain::weaker_test {
namespace {

using namespace config;

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
              "lines/floor1/stations/press: access read_only -> read_write");
    EXPECT_EQ(told(station, ", guard: true", ""),
              "lines/floor1/stations/press: guard true -> false");
    EXPECT_EQ(one_way(station(", guard: true, profile: omron-cp2e"), station(", guard: true")),
              "lines/floor1/stations/press: profile omron-cp2e -> generic")
        << "which refuses something else";
}

TEST(Weaker, WhatMayBeWrittenToPoints) {
    const Maker point = [](const std::string& keys) {
        return plant("serial: {baud: 38400, parity: none}, ",
                     ", profile: autonics-gplp-s, points: [{name: set, at: UW100" + keys + "}]",
                     kListener);
    };
    EXPECT_EQ(told(point, "", ", writable: true"),
              "lines/floor1/stations/press/points/set: writable false -> true");
    EXPECT_EQ(told(point, ", writable: true, max: 50", ", writable: true, max: 400"),
              "lines/floor1/stations/press/points/set: max 50 -> 400");
    EXPECT_EQ(told(point, ", writable: true, min: 5, max: 50", ", writable: true"),
              "lines/floor1/stations/press/points/set: max 50 -> not set; "
              "lines/floor1/stations/press/points/set: min 5 -> not set");
    EXPECT_EQ(told(point, ", max: 50", ", max: 400"), "") << "never written";
    EXPECT_EQ(one_way(point(", writable: true"), point(", writable: true, scale: 0.1")),
              "lines/floor1/stations/press/points/set: scale 1 -> 0.1");
}

TEST(Weaker, WritesThatAreRepeated) {
    EXPECT_EQ(told(station, "", ", retry_writes: true"),
              "lines/floor1/stations/press: retry_writes false -> true");
    EXPECT_EQ(told(station, ", retry_writes: true", ", retry_writes: true, retries: 3"),
              "lines/floor1/stations/press: retries 1 -> 3");
    EXPECT_EQ(told(station, ", retries: 1", ", retries: 3"), "") << "of reads";
    EXPECT_EQ(told(station, "", ", retry_writes: true, retries: 0"), "");
    EXPECT_EQ(told(station, "", "}, {id: 32, name: oven, retry_writes: true"),
              "lines/floor1/stations/oven: added");
}

TEST(Weaker, WhatRelaysWrite) {
    const Maker relays = [](const std::string& list) {
        return "lines: [{name: a, device: sim, stations: [{id: 1, name: one}, {id: 2, name: "
               "two}]}]\n" +
               kListener + "relays: [" + list + "]\n";
    };
    const std::string one = "{from: one/400001, to: two/400101}";
    EXPECT_EQ(told(relays, "", one), "relays/one/400001 to two/400101: added");
    EXPECT_EQ(told(relays, one, "{from: one/400001, to: two/400101, count: 4}"),
              "relays/one/400001 to two/400101: count 1 -> 4");
    EXPECT_EQ(one_way(relays(one), relays("{from: one/400002, to: two/400101}")),
              "relays/one/400002 to two/400101: added")
        << "other values";
    EXPECT_EQ(told(relays, one, "{from: one/400001, to: two/400101, every: 5s}"), "");
}

TEST(Weaker, AProtectedStationUnderAnotherName) {
    const auto named = [](const std::string& keys) {
        return plant("unlisted_stations: refuse, ", "}, {id: 5" + keys, kListener);
    };
    EXPECT_EQ(one_way(named(", name: a, access: read_only"), named(", name: b")),
              "lines/floor1/stations/a: removed");
    EXPECT_EQ(one_way(named(", name: a, guard: true"), named(", name: b")),
              "lines/floor1/stations/a: removed");
    EXPECT_EQ(one_way(named(", name: a, access: read_only"), named(", name: b, access: read_only")),
              "");
}

TEST(Weaker, NotAStationThatIsTakenAway) {
    const std::string three = station(
        "}, {id: 5, name: a, access: read_only}, {id: 6, name: b, guard: true, profile: "
        "omron-cp2e");
    EXPECT_EQ(one_way(three, station("")), "") << "as a rollback takes away what a file added";
}

TEST(Weaker, UnlistedStationsAndTheModeOfALine) {
    EXPECT_EQ(told(line, "unlisted_stations: refuse, ", ""),
              "lines/floor1: unlisted_stations refuse -> pass");
    Config listening = loaded(line(""));
    listening.lines[0].listens = true;
    EXPECT_EQ(joined(weaker(listening, loaded(line("")))), "lines/floor1: mode listen -> master");
}

TEST(Weaker, AccessAndBroadcastsOfAListener) {
    EXPECT_EQ(told(endpoint, ", access: read_only", ""),
              "modbus_tcp/127.0.0.1:1502: access read_only -> read_write");
    EXPECT_EQ(told(endpoint, ", broadcast: deny", ""),
              "modbus_tcp/127.0.0.1:1502: broadcast deny -> reply");
    EXPECT_EQ(told(endpoint, "", ", udp: true"), "modbus_tcp/127.0.0.1:1502: udp false -> true");
    EXPECT_EQ(told(endpoint, "", ", diagnostics_unit: 255"),
              "modbus_tcp/127.0.0.1:1502: diagnostics_unit null -> 255");
}

TEST(Weaker, AListenerOnAWiderAddressOrAnotherPort) {
    EXPECT_EQ(one_way(at("127.0.0.1:1502"), at("0.0.0.0:1502")), "modbus_tcp/0.0.0.0:1502: added");
    EXPECT_EQ(one_way(at("127.0.0.1:1502"), at("127.0.0.1:1503")),
              "modbus_tcp/127.0.0.1:1503: added");
    EXPECT_EQ(one_way(http_at("127.0.0.1:8080"), http_at("0.0.0.0:8080")),
              "http: listen 127.0.0.1:8080 -> 0.0.0.0:8080");
    EXPECT_EQ(told(station(""), http("")), "http: added");
}

TEST(Weaker, AllowThatLetsMoreIn) {
    const std::string one = ", allow: [127.0.0.1/32]";
    EXPECT_EQ(told(endpoint, one, ", allow: [127.0.0.0/8]"),
              "modbus_tcp/127.0.0.1:1502: allow [127.0.0.1/32] -> [127.0.0.0/8]");
    EXPECT_EQ(told(endpoint, one, ", allow: [127.0.0.1/32, 10.0.0.5]"),
              "modbus_tcp/127.0.0.1:1502: allow [127.0.0.1/32] -> [10.0.0.5/32, 127.0.0.1/32]");
    EXPECT_EQ(told(endpoint, one, ""),
              "modbus_tcp/127.0.0.1:1502: allow [127.0.0.1/32] -> not set");
    EXPECT_EQ(told(endpoint, ", allow: [10.0.0.0/8]", ", allow: ['::/0']"),
              "modbus_tcp/127.0.0.1:1502: allow [10.0.0.0/8] -> ['::/0']");
    EXPECT_EQ(told(http, one, ""), "http: allow [127.0.0.1/32] -> not set");
}

TEST(Weaker, PagesOfMoreSitesThatMayRead) {
    EXPECT_EQ(told(http, ", cors: ['http://a.example']",
                   ", cors: ['http://a.example', 'http://b.example:81']"),
              "http: cors [http://a.example] -> [http://a.example, http://b.example:81]");
    EXPECT_EQ(told(http, "", ", cors: ['http://a.example']"),
              "http: cors not set -> [http://a.example]");
}

TEST(Weaker, HostsThatAreMore) {
    EXPECT_EQ(told(http, ", hosts: [a.example]", ", hosts: [a.example, b.example]"),
              "http: hosts [a.example] -> [a.example, b.example]");
    EXPECT_EQ(one_way(http(", hosts: [a.example]"), http("")),
              "http: hosts [a.example] -> not set");
}

TEST(Weaker, RolesOfAnonymousClientsAndOfTokens) {
    EXPECT_EQ(told(http, ", anonymous: viewer", ", anonymous: operator"),
              "http: anonymous viewer -> operator");
    const Maker tokens = [](const std::string& list) { return http(", tokens: [" + list + "]"); };
    const std::string a = "{name: a, role: viewer, file: /a}";
    EXPECT_EQ(told(tokens, a, "{name: a, role: operator, file: /a}"),
              "http/tokens/a: role viewer -> operator");
    EXPECT_EQ(told(tokens, a, a + ", {name: b, role: viewer, file: /b}"), "http/tokens/b: added");
    EXPECT_EQ(one_way(tokens(a), tokens("{name: a, role: viewer, file: /b}")),
              "http/tokens/a: secret changed")
        << "another secret";
}

TEST(Weaker, AnotherContentOfTheFilesThatSayWhomToTrust) {
    Config running = loaded(http(""));
    running.http->tls.emplace();
    Config next = running;
    next.http->tls->material.certificate = "renewed";
    EXPECT_EQ(joined(weaker(running, next)), "") << "shown to clients";
    next.http->tls->material.ca = "another";
    EXPECT_EQ(joined(weaker(running, next)), "http/tls: trusted changed");
}

TEST(Weaker, ARoleOfAnotherNameByItsRights) {
    const Maker roles = [](const std::string& anonymous) {
        return http(", anonymous: " + anonymous) +
               "access: {roles: [{name: eye, rights: [read]}, {name: hand, rights: [read, "
               "write]}]}\n";
    };
    EXPECT_EQ(one_way(roles("viewer"), roles("eye")), "");
    EXPECT_EQ(one_way(roles("operator"), roles("hand")), "");
    EXPECT_EQ(told(roles, "viewer", "hand"), "http: anonymous viewer -> hand");
    EXPECT_EQ(told(roles, "eye", "operator"), "http: anonymous eye -> operator");
}

TEST(Weaker, ARoleOfTheSameNameThatHasMoreRights) {
    const Maker rights = [](const std::string& list) {
        return http(", anonymous: maint, tokens: [{name: a, role: maint, file: /a}]") +
               "access: {roles: [{name: maint, rights: [" + list + "]}]}\n";
    };
    EXPECT_EQ(told(rights, "read", "read, raw"),
              "access/roles/maint: rights [read] -> [raw, read]");
}

TEST(Weaker, AListenerThatReachesMore) {
    const Maker two = [](const std::string& keys) {
        return "lines: [{name: a, device: sim, stations: [{id: 1}]}, {name: b, device: sim, "
               "stations: [{id: 2}]}]\nmodbus_tcp: [{listen: '127.0.0.1:1502', " +
               keys + "}]\n";
    };
    EXPECT_EQ(told(two, "lines: [a]", "lines: [a, b]"),
              "modbus_tcp/127.0.0.1:1502: lines [a] -> [a, b]");
    EXPECT_EQ(told(two, "lines: [a]", "lines: [a], units: {9: b/2}"),
              "modbus_tcp/127.0.0.1:1502/units: 9 added, b/2");
    EXPECT_EQ(one_way(two("lines: [a], units: {0: a/1}"), two("lines: [a]")),
              "modbus_tcp/127.0.0.1:1502/units: 0 removed, was a/1");
    EXPECT_EQ(one_way(two("lines: [a], units: {0: a/1}"), two("lines: [a], broadcast: deny")), "");
}

TEST(Weaker, WritesOfABroker) {
    const Maker mqtt = [](const std::string& keys) {
        return station("") + "mqtt: {broker: 'mqtt://127.0.0.1', topic: a" + keys + "}\n";
    };
    EXPECT_EQ(told(mqtt, "", ", write: points"), "mqtt: write none -> points");
    EXPECT_EQ(told(station(""), mqtt(", write: points")), "mqtt: added");
    EXPECT_EQ(told(station(""), mqtt("")), "");
    EXPECT_EQ(told(mqtt, "", ", password_file: /a, username: u"), "") << "the broker's";
}

}  // namespace
}  // namespace panelgate::explain::weaker_test
