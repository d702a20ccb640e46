#include "panelgate/explain/difference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::explain::moved_units_test {
namespace {

using config::load_valid;

/// Each change on a line of its own.
std::string told(const std::string& before, const std::string& after) {
    std::string texts;
    for (const std::string& text : moved_units(load_valid(before), load_valid(after)))
        texts += text + '\n';
    return texts;
}

/// What is told of one unit, with the advice to keep it.
std::string moved(const std::string& unit, const std::string& was, const std::string& now,
                  const std::string& kept) {
    return "unit " + unit + " was " + was + " and is now " + now +
           ": a write to it may reach another panel; inform its clients first, or keep it with "
           "units: {" +
           kept + "}\n";
}
/// ... and where its target is not listed.
std::string unlisted(const std::string& unit, const std::string& was, const std::string& now) {
    return "unit " + unit + " of 127.0.0.1:1502 was " + was + " and is now station " + now +
           " (not listed): a write to it may reach another panel; set unlisted_stations: refuse "
           "there, or inform its clients first\n";
}

std::string two_lines(const std::string& of_a, const std::string& listener) {
    return "lines:\n  - {name: a, device: sim, " + of_a +
           "stations: [{id: 1, name: one}]}\n"
           "  - {name: b, device: sim, stations: [{id: 2, name: two}]}\n"
           "modbus_tcp: [{listen: '127.0.0.1:1502', " +
           listener + "}]\n";
}

/// One line and one listener; `stations` and `of_listener` are what differs.
std::string one_line(const std::string& stations, const std::string& of_listener = "") {
    return "lines: [{name: a, device: /dev/ttyUSB0, stations: [" + stations +
           "]}]\nmodbus_tcp: [{listen: '127.0.0.1:1502'" + of_listener + "}]\n";
}

const std::string kOne = "{id: 1, name: one}";

TEST(MovedUnits, TellsThatUnitsOfARemovedLineNowReachTheOneThatIsLeft) {
    const std::string both = two_lines("", "lines: [a, b]");
    EXPECT_EQ(told(both, two_lines("", "lines: [a]")),
              unlisted("2", "'two' of line b", "2 of line a"));
    EXPECT_EQ(std::ranges::count(told(both, one_line(kOne)), '\n'), 1)
        << "the line is gone altogether";
}

TEST(MovedUnits, IsSilentWhereTheyReachNobodyOrAreNamed) {
    const std::string both = two_lines("", "lines: [a, b]");
    EXPECT_EQ(told(both, both), "");
    EXPECT_EQ(told(both, two_lines("unlisted_stations: refuse, ", "lines: [a]")), "");
    EXPECT_EQ(told(both, two_lines("", "lines: [a], units: {2: b/2}")), "");
}

TEST(MovedUnits, TellsOfAliasesThatAreSwapped) {
    EXPECT_EQ(
        told(two_lines("", "lines: [a, b], units: {101: a/1, 102: b/2}"),
             two_lines("", "lines: [a, b], units: {101: b/2, 102: a/1}")),
        moved("101 of 127.0.0.1:1502", "'one' of line a", "'two' of line b", "101: a/one") +
            moved("102 of 127.0.0.1:1502", "'two' of line b", "'one' of line a", "102: b/two"));
}

TEST(MovedUnits, TellsOfStationsThatHaveSwappedTheirIds) {
    EXPECT_EQ(told(one_line("{id: 1, name: one}, {id: 2, name: two}"),
                   one_line("{id: 2, name: one}, {id: 1, name: two}")),
              moved("1 of 127.0.0.1:1502", "'one' of line a", "'two' of line a", "1: a/one") +
                  moved("2 of 127.0.0.1:1502", "'two' of line a", "'one' of line a", "2: a/two"));
}

TEST(MovedUnits, TellsOfAnAliasThatIsGoneAndOfAPanelWithAnotherId) {
    EXPECT_EQ(told(one_line(kOne, ", units: {101: a/1}"), one_line(kOne)),
              unlisted("101", "'one' of line a", "101 of line a"));
    const std::string other_id = told(one_line(kOne), one_line("{id: 9, name: one}"));
    EXPECT_EQ(std::ranges::count(other_id, '\n'), 1) << other_id;
}

TEST(MovedUnits, IsSilentWhereOnlyAPanelOrALineHasAnotherName) {
    EXPECT_EQ(told(one_line(kOne), one_line("{id: 1, name: press}")), "");
    EXPECT_EQ(told(one_line("{id: 1, name: one}, {id: 2}"), one_line("{id: 2}")), "")
        << "the same panel, not listed any more";
    const std::string renamed =
        "lines: [{name: hall, device: /dev/ttyUSB0, stations: [{id: 1}]}]\n"
        "modbus_tcp: [{listen: '127.0.0.1:1502'}]\n";
    EXPECT_EQ(told(one_line("{id: 1}"), renamed), "");
}

TEST(MovedUnits, TellsThatAWriteToAStationIsNowABroadcast) {
    EXPECT_EQ(told(one_line(kOne, ", units: {0: a/1}"), one_line(kOne)),
              "unit 0 of 127.0.0.1:1502 was 'one' of line a and is now a broadcast to all "
              "stations: a write to it may reach another panel; set broadcast: deny, or inform its "
              "clients first\n");
    EXPECT_EQ(told(one_line(kOne, ", units: {0: a/1}"), one_line(kOne, ", broadcast: deny")), "");
}

TEST(MovedUnits, TellsThatABroadcastIsNowAWriteToOneStation) {
    EXPECT_EQ(told(one_line(kOne), one_line(kOne, ", units: {0: a/1}")),
              "unit 0 of 127.0.0.1:1502 was a broadcast to all stations and is now 'one' of line "
              "a: a write to it may reach another panel; inform its clients first\n");
}

TEST(MovedUnits, TellsThatABroadcastReachesAnotherLineThatWasThere) {
    const std::string one = two_lines("", "lines: [a], units: {2: b/2}");
    const std::string both = two_lines("", "lines: [a, b]");
    EXPECT_EQ(told(one, both),
              "unit 0 of 127.0.0.1:1502 reaches line b as well: a broadcast is now written to its "
              "panels too; set broadcast: deny, or inform its clients first\n");
    EXPECT_EQ(told(one, two_lines("", "broadcast: deny, lines: [a, b]")), "");
    EXPECT_EQ(told(one_line(kOne), both), "") << "it is a new line";
}

TEST(MovedUnits, KnowsListenersOfOneNameByTheirOrder) {
    const std::string two =
        "lines:\n  - {name: a, device: sim, stations: [{id: 1, name: one}]}\n"
        "  - {name: b, device: sim, stations: [{id: 1, name: two}]}\n"
        "modbus_tcp: [{listen: '127.0.0.1:0', lines: [a]}, {listen: '127.0.0.1:0', lines: [b]}]\n";
    EXPECT_EQ(told(two, two), "");
}

TEST(MovedUnits, AreThoseOfSerialMastersAsWell) {
    const auto master = [](const std::string& units) {
        return "lines: [{name: a, device: /dev/ttyUSB0, stations: [{id: 1, name: one}, {id: 2, "
               "name: two}]}]\nserial_masters: [{name: plc, device: /dev/ttyUSB1" +
               units + "}]\n";
    };
    const std::string before = master(", units: {101: a/1}");
    EXPECT_EQ(
        told(before, master(", units: {101: a/2}")),
        moved("101 of serial master plc", "'one' of line a", "'two' of line a", "101: a/one"));
    EXPECT_EQ(told(before, master("")), "") << "it is not answered for 101";
}

}  // namespace
}  // namespace panelgate::explain::moved_units_test
