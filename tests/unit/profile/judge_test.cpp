#include "panelgate/profile/judge.hpp"

#include <gtest/gtest.h>

#include "panelgate/profile/load_profile.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::profile::judge_test {
namespace {

struct Case {
    const char* name;
    const char* profile;
    Bytes pdu;
    Judgement expected;
};

const Case kCases[] = {
    {"ReadUW0", "autonics-gplp-s", "03 00 00 00 05"_hex, Judgement::fine},
    {"ReadTooMany", "autonics-gplp-s", "03 00 00 00 7E"_hex, Judgement::illegal_value},
    {"ReadNone", "autonics-gplp-s", "03 00 00 00 00"_hex, Judgement::illegal_value},
    {"ReadBeyondTheEnd", "autonics-gplp-s", "03 FF FF 00 01"_hex, Judgement::illegal_address},
    {"AFunctionThatThePanelLacks", "autonics-gplp-s", "17 00 00 00 01 00 00 00 01 02 00 00"_hex,
     Judgement::illegal_function},
    {"NothingAtAll", "generic", ""_hex, Judgement::illegal_function},
    {"ACoilValueThatIsNone", "generic", "05 00 00 12 34"_hex, Judgement::illegal_value},
    {"ALengthThatContradicts", "generic", "10 00 00 00 02 02 00 01"_hex, Judgement::illegal_value},
    {"AWrite", "generic", "10 00 00 00 02 04 00 01 00 02"_hex, Judgement::fine},
};

class Judge : public testing::TestWithParam<Case> {};

TEST_P(Judge, SaysWhatTheManualSays) {
    static const Catalogue shipped = Catalogue::shipped();
    const PanelProfile* profile = shipped.find(GetParam().profile);
    ASSERT_NE(profile, nullptr);
    EXPECT_EQ(judge(*profile, GetParam().pdu), GetParam().expected);
}
INSTANTIATE_TEST_SUITE_P(Requests, Judge, testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

TEST(Judge, ExplainsItselfInWordsOfThePanel) {
    static const Catalogue shipped = Catalogue::shipped();
    const auto why = [&](const char* profile, const Bytes& pdu) {
        return explain(*shipped.find(profile), test::request_of(pdu));
    };
    EXPECT_EQ(why("autonics-gplp-s", "03 00 00 00 05"_hex), "");
    EXPECT_EQ(why("autonics-gplp-s", "17 00 00 00 01 00 00 00 01 02 00 00"_hex),
              "autonics-gplp-s has no function 23");
    EXPECT_EQ(why("generic", "05 00 00 12 34"_hex), "function 5 does not take these values");
}

TEST(Judge, KnowsWhatCanBeReadAndNotWritten) {
    static const Catalogue shipped = Catalogue::shipped();
    int found = 0;
    for (const auto& [name, profile] : shipped.all()) {
        for (const Area& area : profile.areas) {
            if (area.table != modbus::Table::holding_registers || area.writable) continue;
            if (profile.find_function(6) == nullptr) continue;
            const Bytes pdu =
                modbus::encode_write_register(static_cast<std::uint16_t>(area.readable.first), 1);
            if (profile.find_area(area.table, area.readable.first) != &area) continue;
            EXPECT_EQ(judge(profile, pdu), Judgement::write_protected) << name << ' ' << area.name;
            ++found;
        }
    }
    EXPECT_GT(found, 0);
}

}  // namespace
}  // namespace panelgate::profile::judge_test
