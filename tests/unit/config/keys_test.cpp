#include "keys.hpp"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "memory_files.hpp"
#include "setting_writer.hpp"

namespace panelgate::config::keys_test {
namespace {

using testing::ElementsAre;

enum class Colour : std::uint8_t { red, green };

struct Lamp {
    std::size_t count = 3;
    Duration every = 2s;
    bool bright = true;
    double share = 0.5;
    Colour colour = Colour::green;
    std::string place = "hall";
};

const Keys<Lamp>& lamp_keys() {
    static constexpr Words<Colour, 2> kColours{{{"red", Colour::red}, {"green", Colour::green}}};
    static const auto kKeys =
        Keys<Lamp>()
            .integer("count", &Lamp::count, 1, 9, "How many.")
            .duration(
                "every", [](auto& lamp) -> auto& { return lamp.every; }, 1s, 1min, "")
            .boolean("bright", &Lamp::bright, "")
            .share("share", &Lamp::share, "")
            .word("colour", &Lamp::colour, kColours, "")
            .initially("")
            .text("place", &Lamp::place, {}, "Where.");
    return kKeys;
}

struct Reading {
    explicit Reading(const std::string& text) {
        const yaml::Node node = yaml::parse(text, problems);
        Config config;
        Loading loading{files, problems, config};
        Reader in(loading, node, "a lamp");
        given = lamp_keys().read(in, lamp);
        in.finish();
    }

    MemoryFiles files{{}};
    yaml::Problems problems{"x"};
    Lamp lamp;
    Given given;
};

const KeyShape& shape(std::string_view key) {
    for (const Row& row : lamp_keys().rows())
        if (row.shape.path == key) return row.shape;
    throw std::out_of_range(std::string(key));
}

std::vector<std::string> shown(const Lamp& lamp) {
    std::vector<Setting> all;
    lamp_keys().show(SettingWriter(all).below("lamp"), lamp);
    std::vector<std::string> texts;
    for (const Setting& setting : all) texts.push_back(setting.path + '=' + setting.value);
    return texts;
}

TEST(Keys, AreReadIntoTheirMembers) {
    const Reading read("{count: 4, every: 3s, bright: false, share: 0.1, colour: red}");
    EXPECT_EQ(read.problems.text(), "");
    EXPECT_THAT(shown(read.lamp),
                ElementsAre("lamp/count=4", "lamp/every=3s", "lamp/bright=false", "lamp/share=0.1",
                            "lamp/colour=red", "lamp/place=hall"));
    EXPECT_TRUE(read.given.has("count"));
}

TEST(Keys, KeepTheirDefaultsWhereTheyAreAbsentOrWrong) {
    const Reading read("{count: 10, colour: blue}");
    EXPECT_THAT(shown(read.lamp),
                ElementsAre("lamp/count=3", "lamp/every=2s", "lamp/bright=true", "lamp/share=0.5",
                            "lamp/colour=green", "lamp/place=hall"));
    EXPECT_FALSE(read.given.has("count"));
    EXPECT_FALSE(read.given.has("every"));
    EXPECT_EQ(read.problems.list().size(), 2U);
}

TEST(Keys, DescribeThemselves) {
    EXPECT_EQ(shape("count").text, "How many.");
    EXPECT_EQ(shape("count").initial, "3") << "of the struct";
    EXPECT_EQ(shape("count").max, 9);
    EXPECT_EQ(shape("every").initial, "2s");
    EXPECT_EQ(shape("colour").initial, "");
    EXPECT_EQ(shape("place").text, "Where.");
    EXPECT_THAT(lamp_keys().names(),
                ElementsAre("count", "every", "bright", "share", "colour", "place"));
}

TEST(Keys, AreInheritedFromTheirOwner) {
    std::vector<Setting> all;
    const SettingWriter owner = SettingWriter(all).below("hall");
    lamp_keys().show(owner.below("lamp"), {}, &owner);
    EXPECT_EQ(all[0].path, "hall/lamp/count");
    EXPECT_EQ(all[0].otherwise, "hall/count");
}

}  // namespace
}  // namespace panelgate::config::keys_test
