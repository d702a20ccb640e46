#include "sparkplug.hpp"

#include <gmock/gmock.h>

#include "mqtt_plant.hpp"
#include "sparkplug_payload.hpp"

namespace panelgate::mqtt::sparkplug_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Settings settings() {
    Settings made;
    made.format = Format::sparkplug;
    made.group = "g";
    made.node = "n";
    made.write = true;
    return made;
}

State with(State state, points::Quality quality) {
    state.quality = quality;
    return state;
}

/// Returns a payload's seq.
std::optional<std::uint64_t> seq_of(const Message& message) {
    std::optional<std::uint64_t> seq;
    ProtobufReader in(message.payload);
    while (const auto field = in.next())
        if (field->number == 3) seq = field->value;
    return seq;
}

bool is_historical(const Message& message) {
    // is_historical (5) is true: the metric is short enough to be recognised by its bytes.
    return message.payload.find("\x28\x01") != message.payload.npos;
}

class MqttSparkplug : public ::testing::Test {
  protected:
    Publisher publisher_{settings(), small_plant()};

    void deliver(const std::vector<Publisher::Outgoing>& all) {
        for (const Publisher::Outgoing& one : all) publisher_.delivered(one.change);
    }
    std::vector<Publisher::Outgoing> connect() {
        publisher_.will();
        publisher_.connected();
        return take_all(publisher_);
    }
};

/// Expected bytes were generated with npm's sparkplug-payload 1.0.3.
TEST_F(MqttSparkplug, BirthsAreByteForByteThoseOfTahu) {
    publisher_.offer(0, good(true));
    publisher_.offer(2, good(*Decimal::parse("21.5")));
    publisher_.offer(3, with(good(std::int64_t{-2}), points::Quality::stale));
    const Message will = publisher_.will();
    EXPECT_EQ(will.topic, "spBv1.0/g/NDEATH/n");
    EXPECT_EQ(hex(will.payload), "0800120d0a056264536571180020045800");
    EXPECT_EQ(will.qos, 1);
    EXPECT_FALSE(will.retain);
    publisher_.connected();
    const auto node = publisher_.next(kNoon)->message;
    EXPECT_EQ(node.topic, "spBv1.0/g/NBIRTH/n");
    EXPECT_EQ(hex(node.payload),
              "08fad195ffbc3112120a05626453657118fad195ffbc312004580012210a144e6f646520436f6e74726f"
              "6c2f5265626972746818fad195ffbc31200b7000121e0a0f4c696e65732f666c6f6f72312f5570100018"
              "fad195ffbc31200b70011800");
    EXPECT_EQ(node.qos, 0);
    EXPECT_FALSE(node.retain);
    const auto device = publisher_.next(kNoon)->message;
    EXPECT_EQ(device.topic, "spBv1.0/g/DBIRTH/n/press");
    EXPECT_EQ(hex(device.payload),
              "08fad195ffbc3112430a056c6576656c100218fad195ffbc31200a4a260a075175616c6974790a07656e"
              "67556e69741205080318c001120b080c420763656c7369757369000000000080354012290a046d6f6465"
              "100318fad195ffbc3120024a100a075175616c6974791205080318f40350feffffff0f12240a046e616d"
              "65100418fad195ffbc31200c38014a0f0a075175616c6974791204080318001801");
    EXPECT_EQ(publisher_.next(kNoon)->message.topic, "spBv1.0/g/DBIRTH/n/oven");
}

TEST_F(MqttSparkplug, WhatWaitedIsHistoryByteForByte) {
    publisher_.offer(6, good(std::uint64_t{4294967295U}));
    const auto all = connect();
    ASSERT_THAT(topics(all), ElementsAre("spBv1.0/g/NBIRTH/n", "spBv1.0/g/DBIRTH/n/press",
                                         "spBv1.0/g/DBIRTH/n/oven", "spBv1.0/g/DDATA/n/oven"));
    EXPECT_EQ(hex(all[3].message.payload),
              "08fad195ffbc311225100618fad195ffbc31200728014a100a075175616c6974791205080318c00158ff"
              "ffffff0f1803");
    deliver(all);
    publisher_.offer(6, good(std::uint64_t{5}));
    const auto live = take_all(publisher_);
    ASSERT_THAT(live, SizeIs(1));
    EXPECT_FALSE(is_historical(live[0].message));
}

TEST_F(MqttSparkplug, SequenceNumbersGoRoundWithoutAGap) {
    auto all = connect();
    std::uint64_t expected = 0;
    for (int i = 0; i < 600; ++i) {
        publisher_.offer(3, good(std::int64_t{i}));
        for (auto& one : take_all(publisher_)) all.push_back(std::move(one));
    }
    ASSERT_THAT(all, SizeIs(603));
    for (const Publisher::Outgoing& one : all) EXPECT_EQ(seq_of(one.message), expected++ % 256);
}

TEST_F(MqttSparkplug, AStationDiesAndIsBornAgain) {
    connect();
    publisher_.offer(1, station(false, "offline"));
    publisher_.offer(3, good(std::int64_t{1}));  // no host knows this device now
    publisher_.offer(1, station(true, "online"));
    publisher_.offer(1, station(true, "suspect"));
    publisher_.offer(3, good(std::int64_t{2}));
    const auto all = take_all(publisher_);
    EXPECT_THAT(topics(all), ElementsAre("spBv1.0/g/DDEATH/n/press", "spBv1.0/g/DBIRTH/n/press",
                                         "spBv1.0/g/DDATA/n/press"));
    EXPECT_EQ(seq_of(all[0].message), 3U);
}

TEST_F(MqttSparkplug, ADeadStationIsNotBornWithItsNode) {
    publisher_.offer(1, station(false, "offline"));
    EXPECT_THAT(topics(connect()), ElementsAre("spBv1.0/g/NBIRTH/n", "spBv1.0/g/DBIRTH/n/oven"));
}

TEST_F(MqttSparkplug, ARebirthPublishesEverythingAgainUnderTheSameDeath) {
    connect();
    publisher_.offer(0, good(false));
    EXPECT_THAT(topics(take_all(publisher_)), ElementsAre("spBv1.0/g/NDATA/n"));
    publisher_.rebirth();
    const auto all = take_all(publisher_);
    EXPECT_THAT(topics(all), ElementsAre("spBv1.0/g/NBIRTH/n", "spBv1.0/g/DBIRTH/n/press",
                                         "spBv1.0/g/DBIRTH/n/oven"));
    EXPECT_EQ(seq_of(all[0].message), 0U);
    EXPECT_EQ(hex(all[0].message.payload).substr(14, 42),
              "12120a05626453657118fad195ffbc312004580012");
}

TEST_F(MqttSparkplug, RebirthsDuringOneAreOneMore) {
    publisher_.will();
    publisher_.connected();
    std::vector<std::string> births;
    for (int i = 0; i < 2; ++i) {
        publisher_.rebirth();  // at first nothing has been published
        births.push_back(publisher_.next(kNoon)->message.topic);
        publisher_.rebirth();
    }
    for (const std::string& topic : topics(take_all(publisher_))) births.push_back(topic);
    EXPECT_THAT(births, ElementsAre("spBv1.0/g/NBIRTH/n", "spBv1.0/g/DBIRTH/n/press",
                                    "spBv1.0/g/DBIRTH/n/oven", "spBv1.0/g/NBIRTH/n",
                                    "spBv1.0/g/DBIRTH/n/press", "spBv1.0/g/DBIRTH/n/oven"));
}

TEST_F(MqttSparkplug, EachConnectionHasItsDeath) {
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "00");
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "01");
    const std::string farewell = hex(publisher_.farewell(kNoon).payload);
    EXPECT_EQ(farewell.substr(farewell.size() - 4), "5801");
    for (int i = 0; i < 254; ++i) publisher_.will();
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "00");
}

TEST_F(MqttSparkplug, AHostAsksForARebirth) {
    EXPECT_THAT(publisher_.subscriptions(), ElementsAre("spBv1.0/g/NCMD/n", "spBv1.0/g/DCMD/n/+"));
    Metric rebirth;
    rebirth.name = "Node Control/Rebirth";
    rebirth.value = true;
    const auto commands =
        publisher_.commands("spBv1.0/g/NCMD/n", sparkplug_payload(kNoon, {rebirth}, {}), false);
    ASSERT_THAT(commands, SizeIs(1));
    EXPECT_TRUE(std::holds_alternative<Rebirth>(commands[0]));
    rebirth.value = false;
    EXPECT_THAT(
        publisher_.commands("spBv1.0/g/NCMD/n", sparkplug_payload(kNoon, {rebirth}, {}), false),
        IsEmpty());
}

TEST_F(MqttSparkplug, AHostWritesByNameOrAlias) {
    Metric level;
    level.name = "level";
    level.type = DataType::float64;
    level.value = 21.5;
    Metric mode;
    mode.alias = 3;
    mode.type = DataType::int16;
    mode.value = std::int64_t{-2};
    const auto commands = publisher_.commands("spBv1.0/g/DCMD/n/press",
                                              sparkplug_payload(kNoon, {level, mode}, {}), false);
    ASSERT_THAT(commands, SizeIs(2));
    EXPECT_EQ(std::get<WriteCommand>(commands[0]).point, 2U);
    EXPECT_EQ(std::get<WriteCommand>(commands[0]).value, points::Value(21.5));
    EXPECT_EQ(std::get<WriteCommand>(commands[1]).point, 3U);
    EXPECT_EQ(std::get<WriteCommand>(commands[1]).value, points::Value(std::int64_t{-2}));
}

TEST_F(MqttSparkplug, ReportsWhatIsWrongWithACommand) {
    const auto why = [this](std::string_view topic, const std::string& payload,
                            bool retained = false) {
        const auto commands = publisher_.commands(topic, payload, retained);
        const auto* bad = commands.empty() ? nullptr : std::get_if<BadCommand>(&commands[0]);
        return bad != nullptr ? bad->why : "it is taken";
    };
    Metric other;
    other.alias = 6;  // the oven's
    other.value = true;
    const std::string payload = sparkplug_payload(kNoon, {other}, {});
    EXPECT_EQ(why("spBv1.0/g/DCMD/n/press", payload), "there is no such metric");
    EXPECT_EQ(why("spBv1.0/g/DCMD/n/nobody", payload), "there is no such device");
    other.alias = 3;
    other.value.reset();
    EXPECT_EQ(why("spBv1.0/g/DCMD/n/press", sparkplug_payload(kNoon, {other}, {})),
              "the metric has no value");
    EXPECT_THAT(why("spBv1.0/g/DCMD/n/press", "{}"), HasSubstr("no payload of Sparkplug B"));
    EXPECT_THAT(why("spBv1.0/g/DCMD/n/press", payload, true), HasSubstr("must not be retained"));
    EXPECT_THAT(publisher_.commands("spBv1.0/g/DCMD/other/press", payload, false), IsEmpty());
}

TEST_F(MqttSparkplug, WithoutTheSwitchAHostMayOnlyAskForARebirth) {
    Settings closed = settings();
    closed.write = false;
    const Publisher publisher(closed, small_plant());
    EXPECT_THAT(publisher.subscriptions(), ElementsAre("spBv1.0/g/NCMD/n"));
    EXPECT_THAT(publisher.commands("spBv1.0/g/DCMD/n/press", "x", false), IsEmpty());
}

TEST(MqttSparkplugPayload, WhatAHostSendsMeansWhatItsTypeSays) {
    ReceivedMetric heard;
    heard.value = std::uint64_t{0xFFFFFFFE};
    heard.is_integer = true;
    EXPECT_EQ(value_of(heard, DataType::int32), points::Value(std::int64_t{-2}));
    EXPECT_EQ(value_of(heard, DataType::uint32), points::Value(std::uint64_t{0xFFFFFFFE}));
    EXPECT_EQ(value_of(heard, DataType::int64), points::Value(std::int64_t{0xFFFFFFFE}));
    heard.type = 7;  // UInt32, regardless of the point's type
    EXPECT_EQ(value_of(heard, DataType::int32), points::Value(std::uint64_t{0xFFFFFFFE}));
}

std::string payload_of(ProtobufWriter& metric) {
    return ProtobufWriter().bytes(2, metric.take()).take();
}

TEST(MqttSparkplugPayload, WhatIsNullHasNoValue) {
    ProtobufWriter behind, before;
    behind.bytes(1, "mode").varint(10, 9).varint(7, 1);
    before.bytes(1, "mode").varint(7, 1).varint(10, 9);
    for (ProtobufWriter* one : {&behind, &before}) {
        const auto heard = parse_sparkplug(payload_of(*one), 1);
        ASSERT_TRUE(heard);
        EXPECT_EQ(heard->front().value, std::nullopt);
    }
}

TEST(MqttSparkplugPayload, TextIsUtf8) {
    ProtobufWriter good, bad, unnamed;
    good.bytes(1, "name").bytes(15, "\xc3\xa4");
    bad.bytes(1, "name").bytes(15, "\xff\xfe");
    unnamed.bytes(1, "\xff").varint(10, 9);
    EXPECT_TRUE(parse_sparkplug(payload_of(good), 1));
    EXPECT_FALSE(parse_sparkplug(payload_of(bad), 1));
    EXPECT_FALSE(parse_sparkplug(payload_of(unnamed), 1));
}

TEST(MqttSparkplugPayload, HasALimitOfMetrics) {
    const std::vector<Metric> three(3);
    const std::string payload = sparkplug_payload(kNoon, three, {});
    EXPECT_TRUE(parse_sparkplug(payload, 3));
    EXPECT_FALSE(parse_sparkplug(payload, 2));
}

}  // namespace
}  // namespace panelgate::mqtt::sparkplug_test
