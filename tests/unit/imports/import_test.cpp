#include "panelgate/imports/import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

namespace panelgate::imports {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string text_of(const std::string& name) {
    std::ifstream in(TEST_DATA "/imports/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
}

Imported made_of(const std::string& text) {
    yaml::Problems problems("file");
    bool is_known = false;
    const auto made = import_tags(text, problems, is_known);
    EXPECT_TRUE(made) << problems.text();
    EXPECT_TRUE(is_known);
    return made.value_or(Imported{});
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
                                        "file:5: Arr: the address '400030[5]'",
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

TEST(Telegraf, EachStyleIsRead) {
    const Imported made = made_of(text_of("telegraf.conf"));
    EXPECT_THAT(made.yaml, HasSubstr("device: modbus-tcp://10.0.0.5:502"));
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

TEST(Telegraf, RtuOverTcpIsALineOfTcp) {
    EXPECT_THAT(made_of("[[inputs.modbus]]\ncontroller = \"tcp://a:4001\"\n"
                        "transmission_mode = \"RTUoverTCP\"\n")
                    .yaml,
                HasSubstr("device: tcp://a:4001"));
}

TEST(Telegraf, ATextThatIsNoTomlIsToldWithItsPlace) {
    yaml::Problems problems("file");
    bool is_known = false;
    EXPECT_FALSE(import_tags("[[inputs.modbus]]\nname = \n", problems, is_known));
    EXPECT_THAT(problems.text(), HasSubstr("file:2:"));
}

TEST(HomeAssistant, HubsBecomeLinesAndEntitiesPoints) {
    const Imported made = made_of(text_of("configuration.yaml"));
    EXPECT_THAT(made.yaml, HasSubstr("device: modbus-tcp://192.168.1.5:502"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: room-temp, at: \"400017\", type: i16, scale: 0.1"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: energy, at: \"300021\", type: f32, word_order: CDAB"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: pump, at: \"000014\", writable: true"));
    EXPECT_THAT(made.yaml, HasSubstr("{name: door, at: \"100004\""));
    EXPECT_THAT(made.notes, ElementsAre("file:19: weird: the data type 'custom'",
                                        "file:29: ac: climates are not known here"));
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
