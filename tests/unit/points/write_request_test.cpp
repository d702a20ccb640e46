#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/points/point.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "point_of.hpp"

namespace panelgate::points::write_request_test {
namespace {

using namespace std::string_literals;
using enum Type;

const profile::PanelProfile& shipped(const char* name) {
    static const profile::Catalogue catalogue = profile::Catalogue::shipped();
    return *catalogue.find(name);
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

Point at(Point point, std::uint16_t address) {
    point.address = address;
    return point;
}

Point in(modbus::Table table, Point point) {
    point.table = table;
    return point;
}

Point coil(std::uint16_t address) {
    return in(modbus::Table::coils, at(point_of(boolean), address));
}

struct Row {
    profile::PanelProfile panel;
    Point point;
    Value value;
    std::string request;  ///< or the refusal
};

void expect_requests(const std::vector<Row>& rows) {
    for (const Row& row : rows) {
        const auto write = write_request(row.panel, row.point, row.value);
        EXPECT_EQ(write ? to_hex(write->pdu) : write.error().message, row.request)
            << row.panel.name << ' ' << label(row.point.type);
    }
}

TEST(WriteRequest, TakesTheFunctionThatThePanelHas) {
    const profile::PanelProfile& generic = shipped("generic");
    const Point f32_cdab = at(point_of(f32, WordOrder::cdab), 100);
    Point read_only = coil(100);
    read_only.writable = false;
    expect_requests({
        {generic, at(point_of(u16), 100), 7, "06 00 64 00 07"},
        {generic, f32_cdab, 21.5, "10 00 64 00 02 04 00 00 41 ac"},
        {generic, coil(100), true, "05 00 64 ff 00"},
        {generic, read_only, true, "x is not writable"},
        // One goes by the function for several where there is no other.
        {panel_with({modbus::kWriteMultipleRegisters}), point_of(u16), 7,
         "10 00 00 00 01 02 00 07"},
        {panel_with({modbus::kWriteMultipleCoils}), coil(9), true, "0f 00 09 00 01 01 01"},
        {panel_with({modbus::kWriteMultipleCoils}), coil(9), false, "0f 00 09 00 01 01 00"},
        {panel_with({modbus::kWriteSingleCoil}), coil(9), false, "05 00 09 00 00"},
        {panel_with({modbus::kReadHoldingRegisters}), point_of(u16), 7,
         "panel has no function that writes 1 register"},
        // What the value lacks is told when there is a way.
        {generic, point_of(u16), 65536, "x must be from 0 to 65535 (u16), not 65536"},
        {generic, in(modbus::Table::input_registers, point_of(u16)), 65536,
         "D0 is in a table that cannot be written"},
    });
}

TEST(WriteRequest, ABitOfAWordIsNeverReadChangedAndWritten) {
    const std::string no_way =
        " can write no single bit of D0: it has neither function 22 nor a bit view of it, and "
        "reading, changing and writing the word would undo what changes in between";
    const profile::PanelProfile& generic = shipped("generic");
    expect_requests({
        {generic, at(bit_of(4), 18), true, "16 00 12 ff ef 00 10"},
        {generic, at(bit_of(0), 3), false, "16 00 03 ff fe 00 00"},  // the mask keeps the others
        {generic, at(bit_of(15), 3), true, "16 00 03 7f ff 80 00"},
        {shipped("autonics-gplp-s"), at(bit_of(4), 18), true, "0f 01 24 00 01 01 01"},  // UB184
        {shipped("panasonic-gt"), at(bit_of(4), 18), true, "panasonic-gt" + no_way},
    });
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
    profile::PanelProfile without_mask = panel;
    without_mask.functions.pop_back();
    expect_requests({
        {panel, at(bit_of(1), 2), true, "05 00 21 ff 00"},        // bit 33 may be written
        {panel, at(bit_of(1), 3), true, "16 00 03 ff fd 00 02"},  // bit 49 may not
        {without_mask, at(bit_of(1), 3), true, "panel" + no_way},
    });
}

TEST(WriteRequest, AByteLeavesTheOtherOneOfItsRegister) {
    expect_requests({
        {shipped("generic"), at(point_of(Type::u8h), 18), 7, "16 00 12 00 ff 07 00"},
        {shipped("generic"), at(point_of(Type::i8l), 18), -2, "16 00 12 ff 00 00 fe"},
        {shipped("generic"), at(point_of(Type::u8l, WordOrder::badc), 18), 7,
         "16 00 12 00 ff 07 00"},
        {shipped("panasonic-gt"), at(point_of(Type::u8h), 18), 7,
         "panasonic-gt can write no single byte of D0: it has no function 22, and reading, "
         "changing and writing the word would undo what changes in between"},
    });
}

TEST(WriteRequest, TellsWhatThePointIsThen) {
    Point labelled = point_of(u16);
    labelled.labels = {{1, " running"}};
    struct Told {
        Point point;
        Value value;
        const char* told;
    };
    const Told rows[] = {
        {scaled(i16, 0.1), 21.46, "21.5"}, {labelled, " running"s, "1 running"},
        {point_of(f32), 0.1, "0.1"},       {point_of(string), "ab"s, "ab"},
        {bit_of(9), true, "true"},         {coil(0), 0, "false"},
    };
    for (const auto& [point, value, told] : rows) {
        const auto write = write_request(shipped("generic"), point, value, Rounding::nearest);
        ASSERT_TRUE(write.has_value()) << write.error().message;
        EXPECT_EQ(to_string(write->value) + write->label.value_or(""), told);
    }
}

TEST(WriteRequest, WhatAPanelCannotTakeIsToldBeforeAnythingIsWritten) {
    const profile::PanelProfile panel =
        panel_with({modbus::kReadHoldingRegisters, modbus::kWriteSingleRegister});
    const std::string too_long = "generic takes at most 123 registers in one write, not 124";
    EXPECT_EQ(why_unwritable(panel, point_of(u16)), std::nullopt);
    EXPECT_EQ(why_unwritable(panel, point_of(f32)),
              "panel has no function that writes 2 registers at once");
    EXPECT_EQ(why_unwritable(panel, coil(0)), "panel has no function that writes coils");
    EXPECT_EQ(why_unwritable(panel, in(modbus::Table::discrete_inputs, point_of(boolean))),
              "D0 is in a table that cannot be written");
    EXPECT_EQ(why_unwritable(shipped("panasonic-gt"), text_of(248)), std::nullopt);
    EXPECT_EQ(why_unwritable(shipped("generic"), text_of(248)), too_long) << "and is not cut";
    expect_requests({{shipped("generic"), text_of(248), "a"s, too_long}});
    EXPECT_TRUE(write_request(shipped("generic"), text_of(246), "a"s).has_value());
}

}  // namespace
}  // namespace panelgate::points::write_request_test
