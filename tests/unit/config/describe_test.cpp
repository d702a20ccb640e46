#include "panelgate/config/describe.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace panelgate::config::describe_test {
namespace {

using testing::ElementsAre;

const KeyShape& shape(const std::string& path) {
    static const std::vector<KeyShape> kKeys = describe().keys;
    const auto found = std::ranges::find(kKeys, path, &KeyShape::path);
    if (found == kKeys.end()) throw std::out_of_range("no key " + path);
    return *found;
}

TEST(Describe, KnowsWhatTheLoaderAsksFor) {
    EXPECT_EQ(shape("lines/stations/id").kind, KeyShape::Kind::integer);
    EXPECT_TRUE(shape("lines/stations/id").required);
    EXPECT_EQ(shape("lines/stations/id").max, 255);
    EXPECT_EQ(shape("lines/timing/response_timeout").kind, KeyShape::Kind::duration);
    EXPECT_THAT(shape("lines/timing/response_timeout").words, ElementsAre("adaptive"));
    EXPECT_EQ(shape("lines/timing/response_timeout").shortest, Duration(1ms));
    for (const char* key : {"frame_gap", "late_window", "reply_hole"}) {
        const KeyShape& timing = shape("lines/timing/" + std::string(key));
        EXPECT_EQ(timing.kind, KeyShape::Kind::duration) << key;
        EXPECT_THAT(timing.words, ElementsAre("auto")) << key;
    }
    EXPECT_EQ(shape("http/tokens/role").kind, KeyShape::Kind::text) << "or a role of the file";
    EXPECT_EQ(shape("access/roles").kind, KeyShape::Kind::list);
    EXPECT_TRUE(shape("http/tokens/role").required);
    EXPECT_FALSE(shape("log/level").required);
    EXPECT_EQ(shape("modbus_tcp/units").kind, KeyShape::Kind::map);
}

TEST(Describe, KnowsWhatTheLoaderLooksAtItself) {
    EXPECT_EQ(shape("lines").fewest, 1U);
    EXPECT_EQ(shape("lines").may_be_null, false);
    EXPECT_TRUE(shape("lines").required);
    EXPECT_EQ(shape("http/allow").fewest, 1U);
    EXPECT_EQ(shape("http/tokens").may_be_null, false);
    EXPECT_EQ(shape("lines/stations/name").pattern,
              "^(?!(?:all|other)$)[abcdefghijklmnopqrstuvwxyz0123456789-]+$");
    EXPECT_TRUE(shape("lines/stations/name").may_be_number);
    EXPECT_FALSE(shape("http/listen").may_be_number);
    EXPECT_EQ(shape("lines/stations/simulate/late").most, 1.0);
    EXPECT_EQ(shape("lines/stations/points/scale").never, 0.0);
    EXPECT_EQ(shape("lines/serial/data_bits").min, 7);
    EXPECT_EQ(shape("modbus_tcp/diagnostics_unit").may_be_null, true);
    EXPECT_NE(shape("serial_masters/units").keys, shape("modbus_tcp/units").keys);
    const auto rules = describe().rules;
    EXPECT_TRUE(std::ranges::any_of(rules, [](const config::KeyRule& rule) {
        return rule.needs && rule.map == "lines/stations/points" && rule.key == "type" &&
               rule.other == "length";
    }));
}

TEST(Describe, SaysOfEachKeyOnceWhatItIsForOrMeansWithout) {
    std::set<std::string> keys;
    for (const KeyShape& key : describe().keys) {
        EXPECT_TRUE(keys.insert(key.path).second) << key.path;
        EXPECT_FALSE(key.text.empty() && key.initial.empty()) << key.path;
    }
    EXPECT_TRUE(keys.contains("templates") && keys.contains("lines/stations/template"))
        << "they are resolved before loading";
}

}  // namespace
}  // namespace panelgate::config::describe_test
