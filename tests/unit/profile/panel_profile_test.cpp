#include "panelgate/profile/panel_profile.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/profile/judge.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::profile::panel_profile_test {
namespace {

using modbus::Table;

FunctionRule rule(std::uint8_t code, unsigned max_count = 0) {
    return {code, max_count, false, ""};
}
Area area(std::string name, Table table, AddressRange readable) {
    Area made;
    made.name = std::move(name);
    made.table = table;
    made.readable = readable;
    return made;
}

TEST(AddressRange, HoldsItemsOnlyAsAWhole) {
    const AddressRange range{10, 19};
    EXPECT_TRUE(range.contains(10));
    EXPECT_TRUE(range.contains(19));
    EXPECT_TRUE(range.contains(10, 10));
    EXPECT_FALSE(range.contains(9));
    EXPECT_FALSE(range.contains(20));
    EXPECT_FALSE(range.contains(9, 2));
    EXPECT_FALSE(range.contains(10, 11));
    EXPECT_FALSE(range.contains(19, 2));
    const AddressRange all{0, 65535};
    EXPECT_TRUE(all.contains(0, 65536));
    EXPECT_FALSE(all.contains(1, 65536));
    EXPECT_FALSE(all.contains(1, 0xFFFF'FFFF)) << "the sum overflows";
    EXPECT_FALSE(all.contains(0xFFFF'FFFF, 2));
}

TEST(Allows, AnEmptyListAllowsEverything) {
    EXPECT_TRUE(allows<int>({}, 9600));
    EXPECT_TRUE(allows<int>({9600, 19200}, 19200));
    EXPECT_FALSE(allows<int>({9600, 19200}, 38400));
}

TEST(PanelProfile, OneWithoutFunctionsTakesAll) {
    PanelProfile profile;
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_TRUE(profile.has_function(65));
    EXPECT_EQ(profile.find_function(3), nullptr);
    profile.functions = {rule(3)};
    EXPECT_TRUE(profile.has_function(3));
    EXPECT_FALSE(profile.has_function(65));
}

TEST(PanelProfile, WhereTheManualGivesNoLimitTheStandardDoes) {
    PanelProfile profile;
    profile.functions = {rule(1), rule(3, 16), rule(16), rule(15)};
    EXPECT_EQ(profile.max_count(3), 16u);
    EXPECT_EQ(profile.max_count(1), 2000u);
    EXPECT_EQ(profile.max_count(2), 2000u) << "of one that is not listed, too";
    EXPECT_EQ(profile.max_count(4), 125u);
    EXPECT_EQ(profile.max_count(15), 1968u);
    EXPECT_EQ(profile.max_count(16), 123u);
    EXPECT_EQ(profile.max_count(5), 1u);
    EXPECT_EQ(profile.max_count(6), 1u);
}

TEST(PanelProfile, TheFirstAreaThatReachesAnItemIsItsArea) {
    PanelProfile profile;
    profile.areas = {area("clock", Table::holding_registers, {100, 109}),
                     area("D", Table::holding_registers, {0, 999}),
                     area("W", Table::coils, {0, 999})};
    profile.areas[1].also = {Table::input_registers};
    const auto found = [&](Table table, std::uint32_t address) {
        const Area* one = profile.find_area(table, address);
        return one == nullptr ? std::string("none") : one->name;
    };
    EXPECT_EQ(found(Table::holding_registers, 99), "D");
    EXPECT_EQ(found(Table::holding_registers, 100), "clock");
    EXPECT_EQ(found(Table::input_registers, 100), "D") << "the clock is not there";
    EXPECT_EQ(found(Table::coils, 100), "W");
    EXPECT_EQ(found(Table::discrete_inputs, 100), "none");
    EXPECT_EQ(found(Table::holding_registers, 1000), "none");
    EXPECT_EQ(profile.find_area("W"), &profile.areas[2]);
    EXPECT_EQ(profile.find_area("w"), nullptr);
}

class Judge : public ::testing::Test {
  protected:
    Judgement judged(std::string_view panel, const Bytes& pdu) const {
        return judge(*shipped.find(panel), pdu);
    }
    std::string why(std::string_view panel, const Bytes& pdu) const {
        return explain(*shipped.find(panel), test::request_of(pdu));
    }
    const Catalogue shipped = Catalogue::shipped();
};

TEST_F(Judge, SaysWhatTheManualSays) {
    const std::string_view press = "autonics-gplp-s";
    EXPECT_EQ(judged(press, "03 00 00 00 05"_hex), Judgement::fine);
    EXPECT_EQ(judged(press, "03 00 00 00 7E"_hex), Judgement::illegal_value) << "too many";
    EXPECT_EQ(judged(press, "03 00 00 00 00"_hex), Judgement::illegal_value) << "none";
    EXPECT_EQ(judged(press, "03 FF FF 00 01"_hex), Judgement::illegal_address);
    EXPECT_EQ(judged(press, "17 00 00 00 01 00 00 00 01 02 00 00"_hex),
              Judgement::illegal_function);
    EXPECT_EQ(judged("generic", ""_hex), Judgement::illegal_function);
    EXPECT_EQ(judged("generic", "05 00 00 12 34"_hex), Judgement::illegal_value) << "no coil's";
    EXPECT_EQ(judged("generic", "10 00 00 00 02 02 00 01"_hex), Judgement::illegal_value)
        << "the byte count contradicts";
    EXPECT_EQ(judged("generic", "10 00 00 00 02 04 00 01 00 02"_hex), Judgement::fine);
}

TEST_F(Judge, ExplainsItselfInWordsOfThePanel) {
    EXPECT_EQ(why("autonics-gplp-s", "03 00 00 00 05"_hex), "");
    EXPECT_EQ(why("autonics-gplp-s", "17 00 00 00 01 00 00 00 01 02 00 00"_hex),
              "autonics-gplp-s has no function 23");
    EXPECT_EQ(why("generic", "05 00 00 12 34"_hex), "function 5 does not take these values");
}

TEST_F(Judge, KnowsWhatCanBeReadAndNotWritten) {
    int found = 0;
    for (const auto& [name, profile] : shipped.all()) {
        for (const Area& one : profile.areas) {
            if (one.table != Table::holding_registers || one.writable) continue;
            if (profile.find_function(6) == nullptr) continue;
            if (profile.find_area(one.table, one.readable.first) != &one) continue;
            const auto address = static_cast<std::uint16_t>(one.readable.first);
            EXPECT_EQ(judge(profile, modbus::encode_write_register(address, 1)),
                      Judgement::write_protected)
                << name << ' ' << one.name;
            ++found;
        }
    }
    EXPECT_GT(found, 0);
}

}  // namespace
}  // namespace panelgate::profile::panel_profile_test
