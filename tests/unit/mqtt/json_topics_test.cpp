#include "json_topics.hpp"

#include <gmock/gmock.h>

#include "mqtt_plant.hpp"

namespace panelgate::mqtt::json_topics_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Settings settings() {
    Settings made;
    made.topic = "plant/hall";
    made.write = true;
    return made;
}

class MqttJson : public ::testing::Test {
  protected:
    Publisher publisher_{settings(), small_plant()};

    /// Returns the single command parsed from it.
    Command command(std::string_view topic, std::string_view payload, bool retained = false) {
        const auto commands = publisher_.commands(topic, payload, retained);
        EXPECT_EQ(commands.size(), 1U);
        return commands.empty() ? Command(Rebirth{}) : commands.front();
    }
    std::string refusal(std::string_view topic, std::string_view payload, bool retained = false) {
        const Command made = command(topic, payload, retained);
        const auto* bad = std::get_if<BadCommand>(&made);
        return bad != nullptr ? bad->why : "it is taken";
    }
};

TEST_F(MqttJson, PublishesValueQualityUnitAndTime) {
    publisher_.offer(2, good(*Decimal::parse("21.5")));
    publisher_.connected();
    const auto all = take_all(publisher_);
    ASSERT_EQ(all.size(), 3U);
    EXPECT_EQ(all[0].message,
              (Message{"plant/hall/status",
                       R"({"state":"online","time":"2023-11-14T22:13:20.250000Z"})", 1, true}));
    EXPECT_EQ(all[1].message, (Message{"plant/hall/press/level",
                                       R"({"value":21.5,"quality":"good","unit":"celsius",)"
                                       R"("time":"2023-11-14T22:13:20.250000Z"})",
                                       1, true}));
    EXPECT_EQ(all[2].message, all[1].message) << "everything is told at a birth";
}

TEST_F(MqttJson, PublishesLabelsAndMissingValues) {
    State mode = good(std::int64_t{1});
    mode.text = "running";
    publisher_.offer(3, mode);
    State bad;
    bad.quality = points::Quality::bad;
    bad.time = kNoon;
    publisher_.offer(6, bad);
    publisher_.connected();
    const auto all = take_all(publisher_);
    EXPECT_THAT(all[1].message.payload,
                HasSubstr(R"({"value":1,"label":"running","quality":"good")"));
    EXPECT_EQ(all[2].message.topic, "plant/hall/oven/level");
    EXPECT_THAT(all[2].message.payload, HasSubstr(R"({"value":null,"quality":"bad","unit":"")"));
}

TEST_F(MqttJson, PublishesLinesAndStations) {
    State line = good(false);
    line.text = "down: no such device";
    publisher_.offer(0, line);
    publisher_.offer(5, station(true, "online"));
    publisher_.connected();
    const auto all = take_all(publisher_);
    EXPECT_EQ(all[1].message.topic, "plant/hall/line/floor1/state");
    EXPECT_THAT(all[1].message.payload, HasSubstr(R"({"state":"down: no such device")"));
    EXPECT_EQ(all[2].message.topic, "plant/hall/station/oven/state");
    EXPECT_TRUE(all[2].message.retain);
}

TEST_F(MqttJson, WillAndFarewellAreRetained) {
    EXPECT_EQ(publisher_.will(), (Message{"plant/hall/status", R"({"state":"offline"})", 1, true}));
    EXPECT_THAT(publisher_.farewell(kNoon).payload, HasSubstr(R"({"state":"offline","time":)"));
}

TEST_F(MqttJson, TakesAValueOrAnObjectThatHasOne) {
    EXPECT_THAT(publisher_.subscriptions(), ElementsAre("plant/hall/+/+/set"));
    const auto plain = std::get<WriteCommand>(command("plant/hall/press/level/set", " 21.5\n"));
    EXPECT_EQ(plain.point, 2U);
    EXPECT_EQ(plain.value, points::Value(21.5));
    const auto object = std::get<WriteCommand>(
        command("plant/hall/oven/level/set", R"({"value":18446744073709551615,"id":"a\"7"})"));
    EXPECT_EQ(object.point, 6U);
    EXPECT_EQ(object.value, points::Value(std::uint64_t{18446744073709551615U}));
    EXPECT_EQ(object.id, R"("a\"7")");
    EXPECT_EQ(std::get<WriteCommand>(command("plant/hall/press/name/set", R"("on")")).value,
              points::Value(std::string("on")));
    EXPECT_EQ(std::get<WriteCommand>(command("plant/hall/press/name/set", "true")).value,
              points::Value(true));
}

TEST_F(MqttJson, ReportsWhatIsWrongWithACommand) {
    EXPECT_EQ(refusal("plant/hall/press/nobody/set", "1"), "there is no such point");
    EXPECT_EQ(refusal("plant/hall/a/b/c/set", "1"), "there is no such point");
    EXPECT_THAT(refusal("plant/hall/press/level/set", "{"), HasSubstr("not JSON"));
    EXPECT_THAT(refusal("plant/hall/press/level/set", ""), HasSubstr("not JSON"));
    EXPECT_THAT(refusal("plant/hall/press/level/set", R"({"value":1,"value":2})"),
                HasSubstr("comes a second time"));
    EXPECT_EQ(refusal("plant/hall/press/level/set", "{}"), "there is no value");
    EXPECT_THAT(refusal("plant/hall/press/level/set", "[1]"), HasSubstr("value must be a number"));
    EXPECT_THAT(refusal("plant/hall/press/level/set", "1", true),
                HasSubstr("must not be retained"));
    EXPECT_THAT(refusal("plant/hall/press/level/set", std::string(5000, '1')),
                HasSubstr("at most 4096 bytes"));
}

TEST_F(MqttJson, OtherTopicsAreNoCommands) {
    EXPECT_THAT(publisher_.commands("plant/hall/press/level", "1", false), IsEmpty());
    EXPECT_THAT(publisher_.commands("plant/hall/set", "1", false), IsEmpty());
    EXPECT_THAT(publisher_.commands("plant/hallway/press/level/set", "1", false), IsEmpty());
    EXPECT_THAT(publisher_.commands("plant/hall/press/level/set/result", "1", false), IsEmpty());
}

TEST_F(MqttJson, WithoutTheSwitchWritesAreIgnored) {
    Settings closed = settings();
    closed.write = false;
    Publisher publisher(closed, small_plant());
    EXPECT_THAT(publisher.subscriptions(), IsEmpty());
    EXPECT_THAT(publisher.commands("plant/hall/press/level/set", "1", false), IsEmpty());
}

TEST_F(MqttJson, ResultsSayWhichWriteTheyAreOf) {
    publisher_.connected();
    take_all(publisher_);
    publisher_.answer({publisher_.topic_of(2), "7", R"({"ok":true})"}, false);
    publisher_.answer({publisher_.topic_of(2), "", R"({"ok":false})"}, false);
    const auto all = take_all(publisher_);
    ASSERT_EQ(all.size(), 2U);
    EXPECT_EQ(all[0].message,
              (Message{"plant/hall/press/level/set/result", R"({"id":7,"ok":true})", 1, false}));
    EXPECT_EQ(all[1].message.payload, R"({"ok":false})");
}

}  // namespace
}  // namespace panelgate::mqtt::json_topics_test
