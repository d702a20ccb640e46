#include "panelgate/imports/import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace panelgate::imports {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

std::string text_of(const std::string& name) {
    std::ifstream in(TEST_DATA "/imports/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
}

Imported made_of(const std::string& text, const Check& check = {}) {
    yaml::Problems problems("file");
    bool is_known = false;
    const auto made = import_tags(text, problems, is_known, check);
    EXPECT_TRUE(made) << problems.text();
    EXPECT_TRUE(is_known);
    return made.value_or(Imported{});
}

/// What is told of a text without a tag that can be taken.
std::string refusal_of(const std::string& text) {
    yaml::Problems problems("file");
    bool is_known = false;
    const auto made = import_tags(text, problems, is_known);
    EXPECT_FALSE(made) << made->yaml;
    EXPECT_TRUE(is_known);
    return problems.text();
}

/// A part of a file, and what becomes of it. A good tag of the file has the point `good`.
struct Case {
    std::string typed;
    std::string point;  ///< "": none
    std::string note;   ///< "": none
};

/// `around`: a file with a good tag and "@" for the part.
void expect_each(const std::string& around, const std::vector<Case>& cases) {
    for (const auto& [typed, point, note] : cases) {
        SCOPED_TRACE(typed);
        std::string text = around;
        const Imported made = made_of(text.replace(text.find('@'), 1, typed));
        EXPECT_THAT(made.yaml, HasSubstr("{name: good, "));
        EXPECT_THAT(made.yaml, HasSubstr(point));
        if (point.empty()) EXPECT_THAT(made.yaml, Not(HasSubstr("{name: x")));
        if (note.empty())
            EXPECT_THAT(made.notes, Not(Contains(HasSubstr("x: "))));
        else
            EXPECT_THAT(made.notes, Contains(HasSubstr(note)));
    }
}

TEST(Kepware, TagsBecomePointsWithTypeScaleAndAccess) {
    const Imported made = made_of(text_of("kepware.csv"));
    EXPECT_THAT(made.yaml,
                HasSubstr("{name: zone1-temp, at: \"400001\", type: i16, scale: 0.1, unit: C, "
                          "writable: true, every: 100ms}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: flow, at: \"400010\", type: f32, word_order: CDAB"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: run, at: \"400020\", bit: 3, every: 100ms}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: name, at: \"400040\", type: string, length: 20"));
    EXPECT_THAT(made.notes, ElementsAre(HasSubstr("names no device"), HasSubstr("First word low"),
                                        "file:2: Zone1.Temp: Description",
                                        "file:5: Arr: the address '400030[5]' of type Word",
                                        "file:8: Bt: the data type 'Byte'"));
}

TEST(Kepware, AnAddressOfFiveDigitsIsTheSame) {
    const Imported made = made_of("Tag Name,Address,Data Type\na,40013,Word\nb,10003,Boolean\n");
    EXPECT_THAT(made.yaml, HasSubstr("{name: a, at: \"400013\"}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: b, at: \"100003\"}"));
}

TEST(Kepware, EqualNamesBecomeDistinct) {
    const Imported made = made_of(
        "Tag Name,Address,Data Type\nA b,40001,Word\na-B,40002,Word\n"
        "\xC3\xA4,40003,Word\n");
    EXPECT_THAT(made.yaml, HasSubstr("{name: a-b, "));
    EXPECT_THAT(made.yaml, HasSubstr("{name: a-b-2, "));
    EXPECT_THAT(made.yaml, HasSubstr("{name: point, "));
}

TEST(Kepware, EachTagIsTakenRightOrListed) {
    expect_each(
        "Tag Name,Address,Data Type,Client Access,Scan Rate,Scaling,Raw Low,Raw High,Scaled Low,"
        "Scaled High,Clamp Low,Negate Value\ngood,400001,Word\n@\n",
        {{"x,300005,Word,R/W", R"({name: x, at: "300005"})", "x: writes"},
         {"x,100005,Boolean,R/W", R"({name: x, at: "100005"})", "x: writes"},
         {"x,400005.3,Boolean,R/W", R"({name: x, at: "400005", bit: 3, writable: true})", ""},
         {"x,400005,Word,RO,90000000", R"({name: x, at: "400005", every: 1440min})",
          "x: its interval"},
         {"x,400005,Word,RO,0", R"({name: x, at: "400005"})", ""},
         {"x,400120.10L,String", "type: string, length: 10, word_order: BADC}", ""},
         {"x,400120.10H,String", "type: string, length: 10}", ""},
         {"x,400600,Boolean", "", "x: the address '400600' of type Boolean"},
         {"x,000017,Word", "", "x: the address '000017' of type Word"},
         {"x,400007.02,Word", "", "x: the address '400007.02'"},
         {"x,400000,Word", "", "x: the address '400000'"},
         {"x,400001,Short,RO,,Linear,0,1000,0,100,0,1", "type: i16, scale: -0.1}", ""},
         {"x,400001,Short,RO,,Linear,0,1000,0,100,1,0", "scale: 0.1}", "x: Clamp Low"},
         {"x,400001,Short,RO,,,,,,,,1", "type: i16}", "x: Negate Value"},
         {"x,400001,Short,RO,,Square Root,0,10,0,9", "", "x: the scaling 'Square Root'"},
         {"null,400001,Word", "{name: 'null', ", ""},
         {"true,400001,Word", "{name: 'true', ", ""},
         {"1e3,400001,Word", "{name: '1e3', ", ""},
         {"my_tag,400001,Word", "{name: my_tag, ", ""}});
}

TEST(Kepware, AStationHasAtMost4096Points) {
    std::string text = "Tag Name,Address,Data Type\n";
    for (int i = 1; i <= 4098; ++i)
        text += 'T' + std::to_string(i) + ',' + std::to_string(400000 + i) + ",Word\n";
    const Imported made = made_of(text);
    EXPECT_THAT(made.yaml, HasSubstr("{name: t4096, "));
    EXPECT_THAT(made.yaml, Not(HasSubstr("{name: t4097, ")));
    EXPECT_THAT(made.notes, ElementsAre(HasSubstr("names no device"), HasSubstr("First word"),
                                        "file:4098: T4097: the station has 4096 points already",
                                        "file:4099: T4098: the station has 4096 points already"));
}

TEST(Telegraf, EachStyleIsRead) {
    const Imported made = made_of(text_of("telegraf.conf"));
    EXPECT_THAT(made.yaml, HasSubstr("device: modbus-tcp://10.0.0.5:502"));
    EXPECT_THAT(made.yaml, HasSubstr("timing: {response_timeout: 1s}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: powerfactor, at: \"400009\", type: i16, scale: 0.01, "
                                     "every: 5s}"));
    EXPECT_THAT(made.yaml, HasSubstr("word_order: CDAB"));
    EXPECT_THAT(made.yaml, HasSubstr("{baud: 19200, data_bits: 8, parity: even, stop_bits: 1}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: txt, at: \"300003\", type: string, length: 8"));
    EXPECT_THAT(made.yaml, Not(HasSubstr("skipped")));
    EXPECT_THAT(made.yaml, HasSubstr("units: {1: press-line/3, 2: serial/1}"));
    EXPECT_THAT(made.notes, ElementsAre("file:12: Odd: the byte order 'XY'"));
    const Imported metric = made_of(
        "[[inputs.modbus]]\ncontroller = \"tcp://a:502\"\nconfiguration_type = \"metric\"\n"
        "[[inputs.modbus.metric]]\nslave_id = 4\nbyte_order = \"ABCD\"\n"
        "fields = [{register=\"coil\", address=5, name=\"door\"},"
        "{register=\"holding\", address=1, name=\"bit\", type=\"BIT\", bit=2}]\n");
    EXPECT_THAT(metric.yaml, HasSubstr("- id: 4"));
    EXPECT_THAT(metric.yaml, HasSubstr("{name: door, at: \"000006\", every: 10s}"));
    EXPECT_THAT(metric.yaml, HasSubstr("{name: bit, at: \"400002\", bit: 2, every: 10s}"));
}

TEST(Telegraf, EachFieldIsTakenRightOrListed) {
    expect_each(
        "[agent]\ninterval = \"1s\"\n[[inputs.modbus]]\nslave_id = 1\ncontroller = "
        "\"tcp://a:502\"\n"
        "coils = [{name = \"good\", address = [0]}]\nholding_registers = [{name = \"x\", @}]\n",
        {{R"(data_type = "FLOAT32", byte_order = "ABCD", scale = 0.5, address = [4, 5])",
          "type: u32, scale: 0.5}", ""},
         {R"(data_type = "FLOAT32", byte_order = "AB", scale = 0.5, address = [4])",
          R"(at: "400005", scale: 0.5})", ""},
         {R"(data_type = "FIXED", byte_order = "CDAB", address = [4, 5])",
          "type: i32, word_order: CDAB}", ""},
         {R"(data_type = "UFIXED", byte_order = "ABCDEFGH", address = [4, 5, 6, 7])", "type: u64}",
          ""},
         {R"(data_type = "FLOAT32-IEEE", byte_order = "ABCD", address = [4, 5])", "type: f32}", ""},
         {R"(data_type = "FLOAT64-IEEE", byte_order = "GHEFCDAB", address = [4, 5, 6, 7])",
          "type: f64, word_order: CDAB}", ""},
         {R"(data_type = "FLOAT64", byte_order = "ABCDEFGH", address = [4, 5, 6, 7])", "",
          "x: the type 'FLOAT64'"},
         {R"(data_type = "FIXED", byte_order = "AB", address = [4, 5, 6])", "",
          "x: the type 'FIXED' of 3 addresses"},
         {R"(data_type = "UINT16", byte_order = "BA", address = [4])", "word_order: BADC}", ""},
         {R"(data_type = "UINT32", byte_order = "ABCD", address = [25, 24])", "",
          "x: its addresses are not in a row"},
         {R"(data_type = "UINT32", byte_order = "ABCD", address = [30, 32])", "",
          "x: its addresses are not in a row"},
         {R"(data_type = "UINT32", byte_order = "ABCD", address = [40])", "",
          "x: UINT32 of 1 addresses"},
         {R"(data_type = "INT16", byte_order = "AB", address = [])", "", "x: it has no address"},
         {R"(data_type = "INT16", byte_order = "AB", address = [1], measurement = "m")",
          R"({name: x, at: "400002", type: i16})", "x: measurement"}});
}

/// A plugin with one value at station 1, and what is written before.
std::string plugin(const std::string& keys) {
    return "[[inputs.modbus]]\n" + keys + "\ncoils = [{name = \"x\", address = [0]}]\n";
}

TEST(Telegraf, ARequestHasItsOwnTypesAndNoStationOfItself) {
    const std::string head =
        "[[inputs.modbus]]\ncontroller = \"tcp://a:502\"\nconfiguration_type = \"request\"\n"
        "[[inputs.modbus.request]]\nbyte_order = \"ABCD\"\n";
    const std::string fields = "fields = [{name = \"f\", address = 4, type = \"FLOAT32\"}]\n";
    EXPECT_THAT(made_of(head + "slave_id = 1\n" + fields).yaml, HasSubstr("type: f32"));
    EXPECT_THAT(refusal_of(head + fields), HasSubstr("f: station 0"));
    EXPECT_THAT(refusal_of(head + "slave_id = 300\n" + fields), HasSubstr("f: station 300"));
    EXPECT_THAT(refusal_of(plugin("controller = \"tcp://a:502\"\nslave_id = 0")),
                HasSubstr("file:4:1: not taken over: x: station 0"));
}

TEST(Telegraf, EachControllerIsADeviceOrListed) {
    const auto device = [](const std::string& controller) {
        return made_of(plugin("slave_id = 1\ncontroller = \"" + controller + '"')).yaml;
    };
    EXPECT_THAT(device("/dev/ttyS1"), HasSubstr("device: /dev/ttyS1\n"));
    EXPECT_THAT(device("file:///dev/ttyS1"), HasSubstr("device: /dev/ttyS1\n"));
    EXPECT_THAT(device("tcp://plc"), HasSubstr("device: modbus-tcp://plc:502\n"));
    EXPECT_THAT(device("tcp://[::1]"), HasSubstr("device: 'modbus-tcp://[::1]:502'\n"));
    EXPECT_THAT(refusal_of(plugin("controller = \"udp://plc:502\"")),
                HasSubstr("not taken over: inputs.modbus: the controller 'udp://plc:502'"));
    EXPECT_THAT(device("tcp://a:4001\"\ntransmission_mode = \"RTUoverTCP"),
                HasSubstr("device: tcp://a:4001"));
}

TEST(Telegraf, PausesAreTimingAndTheRestIsListed) {
    const Imported made =
        made_of(plugin("slave_id = 1\ncontroller = \"tcp://a:502\"\ntimeout = \"1m30s\"\n"
                       "busy_retries = 3\ninterval = \"1m\"") +
                "[inputs.modbus.workarounds]\npause_after_connect = \"500ms\"\n"
                "pause_between_requests = \"20ms\"\none_request_per_field = true\n");
    EXPECT_THAT(made.yaml, HasSubstr("    connect_pause: 500ms\n"));
    EXPECT_THAT(made.yaml, HasSubstr("    timing: {response_timeout: 90s, station_gap: 20ms}\n"));
    EXPECT_THAT(made.yaml, HasSubstr("every: 1min}"));
    EXPECT_THAT(made.notes, ElementsAre("file:5: inputs.modbus: busy_retries",
                                        HasSubstr("workarounds: one_request_per_field")));
}

TEST(Telegraf, APortHasTheSettingsOfItsFirstSection) {
    const std::string port = "slave_id = 1\ncontroller = \"/dev/ttyS1\"\n";
    const Imported made =
        made_of(plugin(port + "timeout = \"1s\"") + plugin(port + "name = \"b\"\nbaud_rate = 300") +
                plugin(port + "name = \"c\"\ntimeout = \"2s\""));
    EXPECT_THAT(made.yaml, HasSubstr("{name: x-2, at"));
    EXPECT_THAT(made.yaml, Not(HasSubstr("{name: x-3, at")));
    EXPECT_THAT(made.notes,
                ElementsAre("file:6: b: its port is another line's, with other settings",
                            HasSubstr("c: timing {response_timeout: 2s}")));
}

TEST(Telegraf, ATextThatIsNoTomlIsToldWithItsPlace) {
    EXPECT_THAT(refusal_of("[[inputs.modbus]]\nname = \n"), HasSubstr("file:2:"));
    EXPECT_THAT(refusal_of("[[inputs.modbus]]\n[*]\n"), HasSubstr("file:2:"));
}

TEST(HomeAssistant, HubsBecomeLinesAndEntitiesPoints) {
    const Imported made = made_of(text_of("configuration.yaml"));
    EXPECT_THAT(made.yaml, HasSubstr("device: modbus-tcp://192.168.1.5:502"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: room-temp, at: \"400017\", type: i16, scale: 0.1"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: energy, at: \"300021\", type: f32, word_order: CDAB"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: pump, at: \"000014\", writable: true"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: door, at: \"100004\""));
    EXPECT_THAT(made.notes,
                ElementsAre("file:19: weird: the data type 'custom'", "file:29: hub1: climates"));
}

TEST(HomeAssistant, EachSensorIsTakenRightOrListed) {
    expect_each(
        "homeassistant:\n  name: !secret home\nautomation: !include automations.yaml\nmodbus:\n"
        "  - name: modbus_hub\n    type: tcp\n    host: 10.0.0.5\n    port: 502\n    sensors:\n"
        "      - {name: good, address: 1}\n      - {name: x, address: 2, @}\n",
        {{"slave: 3, scan_interval: 1", R"({name: x, at: "400003", type: i16})", ""},
         {"slave: 0", "", "x: station 0"},
         {"slave: 256", "", "x: station 256"},
         {"slave: !secret s", "", "x: slave has no plain value"},
         {"slave: [1]", "", "x: slave has no plain value"},
         {"unit_of_measurement: !secret u", "every: 15s}", "x: unit_of_measurement"},
         {"icon: !secret i", "every: 15s}", "x: icon"},
         {"scale: a", "", "x: scale 'a'"},
         {"scan_interval: 100000", "every: 1440min}", "x: its interval"},
         {"scan_interval: 0", "every: 1440min}", "x: its interval"},
         {"nan_value: 0x8000", "no_value: [32768], every: 15s}", ""},
         {"nan_value: -1", "no_value: [-1], every: 15s}", ""},
         {"nan_value: a", "every: 15s}", "x: nan_value"},
         {"data_type: float32, nan_value: 1", "type: f32, every: 15s}", "x: nan_value"},
         {"data_type: string, count: 4, swap: byte", "length: 8, word_order: BADC,", ""},
         {"virtual_count: 2", "every: 15s}", "x: virtual_count"},
         {"slave_count: 2", "every: 15s}", "x: slave_count"},
         {"min_value: 2", "every: 15s}", "x: min_value"},
         {"max_value: 2", "every: 15s}", "x: max_value"}});
}

TEST(HomeAssistant, OneHubMayStandWithoutAList) {
    const Imported made = made_of(
        "modbus:\n  name: h_1\n  type: rtuovertcp\n  host: fe80::1\n  port: 4001\n  timeout: 5\n"
        "  delay: 2\n  message_wait_milliseconds: 30\n  retries: 3\n"
        "  switches:\n    {name: s, address: 1, command_on: 2, verify: }\n"
        "  binary_sensors: [{name: b, address: 2, input_type: holding}]\n");
    EXPECT_THAT(made.yaml, HasSubstr("  - name: h-1\n    device: 'tcp://[fe80::1]:4001'\n"
                                     "    timing: {response_timeout: 5s, station_gap: 30ms}\n"
                                     "    connect_pause: 2s\n"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: s, at: \"400002\", writable: true, every: 15s}"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: b, at: \"400003\", bit: 0, every: 15s}"));
    EXPECT_THAT(made.notes,
                UnorderedElementsAre(HasSubstr(" h_1: retries"), HasSubstr(" s: command_on"),
                                     HasSubstr(" s: verify")));
}

TEST(HomeAssistant, AHubThatCannotBeTakenIsListed) {
    const std::string sensors = "    sensors: [{name: a, address: 1}]\n";
    EXPECT_THAT(refusal_of("modbus:\n  - name: h\n    type: tcp\n    host: !secret h\n" + sensors),
                HasSubstr("file:2:1: not taken over: h: host has no plain value"));
    EXPECT_THAT(refusal_of("modbus:\n  - name: h\n    type: udp\n    host: h\n" + sensors),
                HasSubstr("not taken over: h: type 'udp'"));
    EXPECT_THAT(refusal_of("modbus: !include modbus.yaml\n"),
                HasSubstr("not taken over: modbus: its keys are not in this file"));
}

TEST(Import, AKeyOfManyIsListedOnce) {
    const Imported made = made_of(
        "modbus:\n  - {name: h, type: tcp, host: h, sensors: [{name: a, address: 1, icon: i}, "
        "{name: b, address: 2, icon: i}, {name: c, address: 3, icon: i}]}\n");
    EXPECT_THAT(made.notes, ElementsAre("file:2: a: icon (and of 2 more)"));
}

TEST(Import, Beyond255StationsThereIsNoUnitId) {
    std::string text = "modbus:\n";
    for (const char* const hub : {"a", "b"}) {
        text += std::string("  - {name: ") + hub + ", type: tcp, host: " + hub + ", sensors: [";
        for (int i = 1; i <= 128; ++i)
            text += "{name: s, address: 1, slave: " + std::to_string(i) + "},";
        text += "]}\n";
    }
    const Imported made = made_of(text);
    EXPECT_THAT(made.yaml, HasSubstr(", 255: b/127}"));
    EXPECT_THAT(made.yaml, Not(HasSubstr("- id: 128\n        name: b-128\n")));
    EXPECT_THAT(made.notes, ElementsAre("file:3: b/128: no unit id is left for this station"));
}

TEST(Import, WhatTheCheckRefusesIsListed) {
    std::string last;
    const Check check = [&](const std::string& yaml) {
        std::vector<yaml::Problem> faults;
        last = yaml;
        int line = 1;
        for (std::size_t at = 0; at < yaml.size(); at = yaml.find('\n', at) + 1, ++line)
            if (const std::string_view rest = std::string_view(yaml).substr(at);
                rest.starts_with("          - {name: bad") || rest.starts_with("    timing:") ||
                rest.starts_with("    device: modbus-tcp://bad"))
                faults.push_back({"", {line, 1}, "refused"});
        return faults;
    };
    const Imported made = made_of(
        "modbus:\n  - {name: h, type: tcp, host: h, timeout: 9, sensors: [{name: good, address: 1},"
        "{name: bad, address: 2}, {name: bad, address: 2, slave: 4}]}\n"
        "  - {name: i, type: tcp, host: bad, sensors: [{name: j, address: 1}]}\n",
        check);
    EXPECT_THAT(made.notes, ElementsAre("file:2: h: refused", "file:2: bad: refused",
                                        "file:2: bad: refused", "file:3: i: refused"));
    EXPECT_THAT(made.yaml, HasSubstr("\n" + last.substr(0, 40)));
    EXPECT_THAT(last, Not(HasSubstr("units")));
    EXPECT_THAT(last, Not(HasSubstr("- id: 4")));
    EXPECT_THAT(last, HasSubstr("{name: good"));
}

TEST(Import, AFaultOfNothingInTheFileEndsIt) {
    yaml::Problems problems("file");
    bool is_known = false;
    const Check check = [](const std::string&) {
        return std::vector<yaml::Problem>{{"", {1, 1}, "refused"}};
    };
    EXPECT_FALSE(
        import_tags("Tag Name,Address,Data Type\na,40013,Word\n", problems, is_known, check));
    EXPECT_THAT(problems.text(), HasSubstr("refused"));
}

TEST(Import, NoNoteLeavesItsComment) {
    const Imported made = made_of(
        "Tag Name,Address,Data Type,Eng Units\ngood,40001,Word,\"a\nb\"\n\"x\nlines: 1\",4,Word\n");
    EXPECT_THAT(made.yaml, Not(HasSubstr("\nlines: 1")));
    EXPECT_THAT(made.yaml, HasSubstr("unit: a b}"));
}

TEST(Import, ATextOfAnotherProgramIsLeftAlone) {
    yaml::Problems problems("file");
    bool is_known = true;
    EXPECT_FALSE(import_tags("device = /dev/ttyUSB0\n", problems, is_known));
    EXPECT_FALSE(is_known);
    EXPECT_THAT(problems.list(), IsEmpty());
}

}  // namespace
}  // namespace panelgate::imports
