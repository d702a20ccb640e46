#include "json_topics.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

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

    std::vector<Publisher::Outgoing> connect() {
        publisher_.connected();
        return take_all(publisher_);
    }
    /// Returns the single command parsed from it.
    Command command(std::string_view topic, std::string_view payload, bool retained = false) {
        const auto commands = publisher_.commands(topic, payload, retained);
        EXPECT_EQ(commands.size(), 1U);
        return commands.empty() ? Command(Rebirth{}) : commands.front();
    }
    points::Value written(std::string_view payload) {
        return std::get<WriteCommand>(command("plant/hall/press/name/set", payload)).value;
    }
    std::string refusal(std::string_view topic, std::string_view payload, bool retained = false) {
        const Command made = command(topic, payload, retained);
        const auto* bad = std::get_if<BadCommand>(&made);
        return bad != nullptr ? bad->why : "it is taken";
    }
};

TEST_F(MqttJson, PublishesValueQualityUnitAndTime) {
    publisher_.offer(2, good(*Decimal::parse("21.5")));
    const auto all = connect();
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

TEST_F(MqttJson, PublishesLabelsMissingValuesLinesAndStations) {
    State mode = good_number(1);
    mode.text = "running";
    State bad;
    bad.quality = points::Quality::bad;
    publisher_.offer(0, station(false, "down: no such device"));
    publisher_.offer(3, mode);
    publisher_.offer(5, station(true, "online"));
    publisher_.offer(6, bad);
    std::string all;
    for (const auto& [message, change] : connect()) {
        all += message.topic + ' ' + message.payload + '\n';
        EXPECT_TRUE(message.retain);
    }
    const char* const parts[] = {
        R"(plant/hall/line/floor1/state {"state":"down: no such device")",
        R"(plant/hall/press/mode {"value":1,"label":"running","quality":"good")",
        R"(plant/hall/station/oven/state {"state":"online")",
        R"(plant/hall/oven/level {"value":null,"quality":"bad","unit":"")",
    };
    for (const char* part : parts) EXPECT_THAT(all, HasSubstr(part));
}

TEST_F(MqttJson, AnAlarmsPayloadIsRetainedAndSentAgainWithAnotherStateOnly) {
    Subjects subjects = small_plant();
    subjects.add_alarm("press-hot");
    Publisher publisher(settings(), subjects);
    publisher.connected();
    take_all(publisher);
    State active;
    active.text = "active";
    active.body = R"({"state":"active","value":81})";
    EXPECT_TRUE(publisher.offer(7, active));
    active.body = R"({"state":"active","value":82})";
    EXPECT_FALSE(publisher.offer(7, active)) << "a value is no change of the alarm";
    const auto all = take_all(publisher);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].message,
              (Message{"plant/hall/alarm/press-hot", R"({"state":"active","value":81})", 1, true}));
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
    EXPECT_EQ(written(R"("on")"), points::Value(std::string("on")));
    EXPECT_EQ(written("true"), points::Value(true));
}

TEST_F(MqttJson, ReportsWhatIsWrongWithACommand) {
    const std::pair<std::string, const char*> payloads[] = {
        {"{", "not JSON"},
        {"", "not JSON"},
        {R"({"value":1,"value":2})", "comes a second time"},
        {"{}", "there is no value"},
        {"[1]", "value must be a number"},
        {std::string(5000, '1'), "at most 4096 bytes"},
    };
    for (const auto& [payload, why] : payloads)
        EXPECT_THAT(refusal("plant/hall/press/level/set", payload), HasSubstr(why)) << payload;
    EXPECT_THAT(refusal("plant/hall/press/level/set", "1", true),
                HasSubstr("must not be retained"));
    for (const char* topic : {"plant/hall/press/nobody/set", "plant/hall/a/b/c/set"})
        EXPECT_EQ(refusal(topic, "1"), "there is no such point");
}

TEST_F(MqttJson, OtherTopicsAreNoCommands) {
    for (const char* topic : {"plant/hall/press/level", "plant/hall/set",
                              "plant/hallway/press/level/set", "plant/hall/press/level/set/result"})
        EXPECT_THAT(publisher_.commands(topic, "1", false), IsEmpty()) << topic;
}

TEST_F(MqttJson, WithoutTheSwitchWritesAreIgnored) {
    Settings closed = settings();
    closed.write = false;
    const Publisher publisher(closed, small_plant());
    EXPECT_THAT(publisher.subscriptions(), IsEmpty());
    EXPECT_THAT(publisher.commands("plant/hall/press/level/set", "1", false), IsEmpty());
}

TEST_F(MqttJson, TheLastWordOfAnotherGatewayIsAnsweredByABirth) {
    Settings both = settings();
    both.write = false;
    both.shared = true;
    const Publisher publisher(both, small_plant());
    EXPECT_THAT(publisher.subscriptions(), ElementsAre("plant/hall/status"));
    const auto said = publisher.commands("plant/hall/status", R"({"state":"offline"})", false);
    ASSERT_EQ(said.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<Rebirth>(said.front()));
    EXPECT_THAT(publisher.commands("plant/hall/status", R"({"state":"online"})", false), IsEmpty());
    EXPECT_THAT(publisher.commands("plant/hall/press/level/set", "1", false), IsEmpty());
}

TEST_F(MqttJson, ResultsSayWhichWriteTheyAreOf) {
    connect();
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
