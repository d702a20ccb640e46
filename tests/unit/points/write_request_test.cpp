#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "panelgate/points/value.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "point_of.hpp"

namespace panelgate::points::write_request_test {
namespace {

const profile::Catalogue& shipped() {
    static const profile::Catalogue catalogue = profile::Catalogue::shipped();
    return catalogue;
}

std::string write(const char* profile, const Point& point, const Value& value) {
    const auto write = write_request(*shipped().find(profile), point, value);
    return write ? to_hex(write->pdu) : write.error().message;
}

TEST(WriteRequest, TakesTheFunctionThatThePanelHas) {
    Point point = point_of(Type::u16);
    point.address = 100;
    EXPECT_EQ(write("generic", point, std::int64_t{7}), "06 00 64 00 07");
    point.type = Type::f32;
    point.word_order = WordOrder::cdab;
    EXPECT_EQ(write("generic", point, 21.5), "10 00 64 00 02 04 00 00 41 ac");
    point.table = modbus::Table::coils;
    point.type = Type::boolean;
    EXPECT_EQ(write("generic", point, true), "05 00 64 ff 00");
    point.writable = false;
    EXPECT_EQ(write("generic", point, true), "x is not writable");
}

TEST(WriteRequest, ABitOfAWordIsNeverReadChangedAndWritten) {
    Point point = point_of(Type::boolean);
    point.bit = 4;
    point.address = 18;
    EXPECT_EQ(write("generic", point, true), "16 00 12 ff ef 00 10");
    EXPECT_EQ(write("autonics-gplp-s", point, true), "0f 01 24 00 01 01 01") << "UB184";
    EXPECT_NE(write("panasonic-gt", point, true).find("can write no single bit of D0"),
              std::string::npos)
        << write("panasonic-gt", point, true);
}

/// A panel that has these functions.
profile::PanelProfile panel_with(std::initializer_list<std::uint8_t> codes) {
    profile::PanelProfile panel;
    panel.name = "panel";
    for (const std::uint8_t code : codes) {
        profile::FunctionRule rule;
        rule.code = code;
        panel.functions.push_back(rule);
    }
    return panel;
}

std::string write(const profile::PanelProfile& panel, const Point& point, const Value& value) {
    const auto write = write_request(panel, point, value);
    return write ? to_hex(write->pdu) : write.error().message;
}

TEST(WriteRequest, OneRegisterGoesByTheFunctionForSeveralWhereThereIsNoOther) {
    const Point point = point_of(Type::u16);
    const profile::PanelProfile panel = panel_with({modbus::kWriteMultipleRegisters});
    EXPECT_EQ(write(panel, point, std::int64_t{7}), "10 00 00 00 01 02 00 07");
    EXPECT_EQ(write(panel_with({modbus::kReadHoldingRegisters}), point, std::int64_t{7}),
              "panel has no function that writes 1 register");
}

TEST(WriteRequest, OneCoilGoesByTheFunctionForSeveralWhereThereIsNoOther) {
    Point coil = point_of(Type::boolean);
    coil.table = modbus::Table::coils;
    coil.address = 9;
    const profile::PanelProfile panel = panel_with({modbus::kWriteMultipleCoils});
    EXPECT_EQ(write(panel, coil, true), "0f 00 09 00 01 01 01");
    EXPECT_EQ(write(panel, coil, false), "0f 00 09 00 01 01 00");
    EXPECT_EQ(write(panel_with({modbus::kWriteSingleCoil}), coil, false), "05 00 09 00 00");
}

TEST(WriteRequest, ABitIsClearedByTheMaskThatKeepsTheOthers) {
    Point point = point_of(Type::boolean);
    point.address = 3;
    point.bit = 0;
    EXPECT_EQ(write("generic", point, false), "16 00 03 ff fe 00 00");
    point.bit = 15;
    EXPECT_EQ(write("generic", point, true), "16 00 03 7f ff 80 00");
}

TEST(WriteRequest, ABitViewThatCannotBeWrittenIsNoWay) {
    profile::PanelProfile panel =
        panel_with({modbus::kWriteSingleCoil, modbus::kMaskWriteRegister});
    profile::Area words;
    words.name = "W";
    words.readable = {0, 9};
    profile::Area bits = words;
    bits.name = "B";
    bits.view_of = "W";
    bits.table = modbus::Table::coils;
    bits.readable = {0, 159};
    bits.writable = profile::AddressRange{32, 47};
    panel.areas = {words, bits};
    Point point = point_of(Type::boolean);
    point.bit = 1;
    point.address = 2;
    EXPECT_EQ(write(panel, point, true), "05 00 21 ff 00") << "bit 33 may be written";
    point.address = 3;
    EXPECT_EQ(write(panel, point, true), "16 00 03 ff fd 00 02") << "bit 49 may not";
    panel.functions.pop_back();
    EXPECT_EQ(why_unwritable(panel, point).value_or("can be"),
              "panel can write no single bit of D0: it has neither function 22 nor a bit view of "
              "it, and reading, changing and writing the word would undo what changes in between");
}

TEST(WriteRequest, TellsWhatThePointIsThen) {
    const auto written = [](const Point& point, const Value& value) {
        const auto write =
            write_request(*shipped().find("generic"), point, value, Rounding::nearest);
        return write ? to_string(write->value) + write->label.value_or("") : write.error().message;
    };
    Point point = point_of(Type::i16);
    point.scale = 0.1;
    EXPECT_EQ(written(point, 21.46), "21.5");
    point = point_of(Type::u16);
    point.labels = {{1, " running"}};
    EXPECT_EQ(written(point, std::string(" running")), "1 running");
    EXPECT_EQ(written(point_of(Type::f32), 0.1), "0.1");
    EXPECT_EQ(written(point_of(Type::string), std::string("ab")), "ab");
    point = point_of(Type::boolean);
    point.bit = 9;
    EXPECT_EQ(written(point, true), "true");
    point.bit.reset();
    point.table = modbus::Table::coils;
    EXPECT_EQ(written(point, std::int64_t{0}), "false");
}

TEST(WriteRequest, WhatTheValueLacksIsToldWhenThereIsAWay) {
    Point point = point_of(Type::u16);
    EXPECT_EQ(write("generic", point, std::int64_t{65536}),
              "x must be from 0 to 65535 (u16), not 65536");
    point.table = modbus::Table::input_registers;
    EXPECT_EQ(write("generic", point, std::int64_t{65536}),
              "D0 is in a table that cannot be written");
}

TEST(WriteRequest, ATextLongerThanOneWriteIsRefusedAndNotCut) {
    Point point = point_of(Type::string);
    point.length = 248;
    const auto refused = write_request(*shipped().find("generic"), point, std::string("a"));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().message, "generic takes at most 123 registers in one write, not 124");
    EXPECT_EQ(why_unwritable(*shipped().find("generic"), point), refused.error().message);
    EXPECT_EQ(why_unwritable(*shipped().find("panasonic-gt"), point), std::nullopt);
    point.length = 246;
    EXPECT_TRUE(write_request(*shipped().find("generic"), point, std::string("a")).has_value());
}

TEST(WriteRequest, APanelWithoutTheFunctionIsToldBeforeAnythingIsWritten) {
    profile::PanelProfile panel;
    panel.name = "reader";
    for (const std::uint8_t code : {modbus::kReadHoldingRegisters, modbus::kWriteSingleRegister}) {
        profile::FunctionRule rule;
        rule.code = code;
        panel.functions.push_back(rule);
    }
    EXPECT_EQ(why_unwritable(panel, point_of(Type::u16)), std::nullopt);
    EXPECT_EQ(why_unwritable(panel, point_of(Type::f32)),
              "reader has no function that writes 2 registers at once");
    Point coil = point_of(Type::boolean);
    coil.table = modbus::Table::coils;
    EXPECT_EQ(why_unwritable(panel, coil), "reader has no function that writes coils");
    coil.table = modbus::Table::discrete_inputs;
    EXPECT_EQ(why_unwritable(panel, coil), "D0 is in a table that cannot be written");
}

TEST(Interpretations, ShowOneBlockInEveryWay) {
    const auto all = interpretations(Words{0x41AC, 0x0000});
    const auto find = [&](Type type, WordOrder order) {
        for (const Interpretation& one : all) {
            if (one.type == type && one.order == order) return one.values;
        }
        return std::vector<std::string>{"none"};
    };
    EXPECT_EQ(find(Type::f32, WordOrder::abcd), std::vector<std::string>{"21.5"});
    EXPECT_EQ(find(Type::u16, WordOrder::abcd), (std::vector<std::string>{"16812", "0"}));
    EXPECT_EQ(find(Type::u32, WordOrder::cdab), std::vector<std::string>{"16812"});
    EXPECT_EQ(find(Type::bcd16, WordOrder::abcd), (std::vector<std::string>{"", "0"}));
    EXPECT_EQ(find(Type::u16, WordOrder::cdab), std::vector<std::string>{"none"});
    EXPECT_EQ(find(Type::f64, WordOrder::abcd), std::vector<std::string>{"none"});
}

}  // namespace
}  // namespace panelgate::points::write_request_test
