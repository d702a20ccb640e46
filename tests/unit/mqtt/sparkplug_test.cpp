#include "sparkplug.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

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

/// What is behind "spBv1.0/g/" in the topics.
std::vector<std::string> kinds(const std::vector<Publisher::Outgoing>& all) {
    std::vector<std::string> names = topics(all);
    for (std::string& name : names) name.erase(0, std::string_view("spBv1.0/g/").size());
    return names;
}

class MqttSparkplug : public ::testing::Test {
  protected:
    Publisher publisher_{settings(), small_plant()};

    std::vector<Publisher::Outgoing> connect() {
        publisher_.will();
        publisher_.connected();
        return take_all(publisher_);
    }
    std::vector<Command> commands(std::string_view topic, const std::vector<Metric>& metrics) {
        return publisher_.commands(topic, sparkplug_payload(kNoon, metrics, {}), false);
    }
};

/// Expected bytes were generated with npm's sparkplug-payload 1.0.3.
TEST_F(MqttSparkplug, BirthsAreByteForByteThoseOfTahu) {
    publisher_.offer(0, good(true));
    publisher_.offer(2, good(*Decimal::parse("21.5")));
    State mode = good_number(-2);
    mode.quality = points::Quality::stale;
    publisher_.offer(3, mode);
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
    ASSERT_THAT(kinds(all),
                ElementsAre("NBIRTH/n", "DBIRTH/n/press", "DBIRTH/n/oven", "DDATA/n/oven"));
    EXPECT_EQ(hex(all[3].message.payload),
              "08fad195ffbc311225100618fad195ffbc31200728014a100a075175616c6974791205080318c00158ff"
              "ffffff0f1803");
    deliver(publisher_, all);
    publisher_.offer(6, good(std::uint64_t{5}));
    const auto live = take_all(publisher_);
    ASSERT_THAT(live, SizeIs(1));
    EXPECT_FALSE(is_historical(live[0].message));
}

TEST_F(MqttSparkplug, SequenceNumbersGoRoundWithoutAGap) {
    auto all = connect();
    std::uint64_t expected = 0;
    for (int i = 0; i < 600; ++i) {
        publisher_.offer(3, good_number(i));
        for (auto& one : take_all(publisher_)) all.push_back(std::move(one));
    }
    ASSERT_THAT(all, SizeIs(603));
    for (const Publisher::Outgoing& one : all) EXPECT_EQ(seq_of(one.message), expected++ % 256);
}

TEST_F(MqttSparkplug, AStationDiesAndIsBornAgain) {
    connect();
    publisher_.offer(1, station(false, "offline"));
    publisher_.offer(3, good_number(1));  // no host knows this device now
    publisher_.offer(1, station(true, "online"));
    publisher_.offer(1, station(true, "suspect"));
    publisher_.offer(3, good_number(2));
    const auto all = take_all(publisher_);
    EXPECT_THAT(kinds(all), ElementsAre("DDEATH/n/press", "DBIRTH/n/press", "DDATA/n/press"));
    EXPECT_EQ(seq_of(all[0].message), 3U);
}

TEST_F(MqttSparkplug, ADeadStationIsNotBornWithItsNode) {
    publisher_.offer(1, station(false, "offline"));
    EXPECT_THAT(kinds(connect()), ElementsAre("NBIRTH/n", "DBIRTH/n/oven"));
}

TEST_F(MqttSparkplug, ARebirthPublishesEverythingAgainUnderTheSameDeath) {
    connect();
    publisher_.offer(0, good(false));
    EXPECT_THAT(kinds(take_all(publisher_)), ElementsAre("NDATA/n"));
    publisher_.rebirth();
    const auto all = take_all(publisher_);
    EXPECT_THAT(kinds(all), ElementsAre("NBIRTH/n", "DBIRTH/n/press", "DBIRTH/n/oven"));
    EXPECT_EQ(seq_of(all[0].message), 0U);
    EXPECT_EQ(hex(all[0].message.payload).substr(14, 42),
              "12120a05626453657118fad195ffbc312004580012");
}

TEST_F(MqttSparkplug, RebirthsDuringOneAreOneMore) {
    publisher_.will();
    publisher_.connected();
    std::vector<Publisher::Outgoing> births;
    for (int i = 0; i < 2; ++i) {
        publisher_.rebirth();  // at first nothing has been published
        births.push_back(*publisher_.next(kNoon));
        publisher_.rebirth();
    }
    for (auto& one : take_all(publisher_)) births.push_back(std::move(one));
    EXPECT_THAT(kinds(births), ElementsAre("NBIRTH/n", "DBIRTH/n/press", "DBIRTH/n/oven",
                                           "NBIRTH/n", "DBIRTH/n/press", "DBIRTH/n/oven"));
}

TEST_F(MqttSparkplug, EachConnectionHasItsDeath) {
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "00");
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "01");
    EXPECT_TRUE(hex(publisher_.farewell(kNoon).payload).ends_with("5801"));
    for (int i = 0; i < 254; ++i) publisher_.will();
    EXPECT_EQ(hex(publisher_.will().payload).substr(32), "00");
}

TEST_F(MqttSparkplug, AHostAsksForARebirth) {
    EXPECT_THAT(publisher_.subscriptions(), ElementsAre("spBv1.0/g/NCMD/n", "spBv1.0/g/DCMD/n/+"));
    Metric rebirth;
    rebirth.name = "Node Control/Rebirth";
    rebirth.value = true;
    const auto asked = commands("spBv1.0/g/NCMD/n", {rebirth});
    ASSERT_THAT(asked, SizeIs(1));
    EXPECT_TRUE(std::holds_alternative<Rebirth>(asked[0]));
    rebirth.value = false;
    EXPECT_THAT(commands("spBv1.0/g/NCMD/n", {rebirth}), IsEmpty());
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
    const auto writes = commands("spBv1.0/g/DCMD/n/press", {level, mode});
    ASSERT_THAT(writes, SizeIs(2));
    EXPECT_EQ(std::get<WriteCommand>(writes[0]).point, 2U);
    EXPECT_EQ(std::get<WriteCommand>(writes[0]).value, points::Value(21.5));
    EXPECT_EQ(std::get<WriteCommand>(writes[1]).point, 3U);
    EXPECT_EQ(std::get<WriteCommand>(writes[1]).value, points::Value(std::int64_t{-2}));
}

TEST_F(MqttSparkplug, ReportsWhatIsWrongWithACommand) {
    const auto why = [this](std::string_view device, const std::string& payload,
                            bool retained = false) {
        const auto made =
            publisher_.commands("spBv1.0/g/DCMD/n/" + std::string(device), payload, retained);
        const auto* bad = made.empty() ? nullptr : std::get_if<BadCommand>(&made[0]);
        return bad != nullptr ? bad->why : "it is taken";
    };
    Metric other;
    other.alias = 6;  // the oven's
    other.value = true;
    const std::string payload = sparkplug_payload(kNoon, {other}, {});
    EXPECT_EQ(why("press", payload), "there is no such metric");
    EXPECT_EQ(why("nobody", payload), "there is no such device");
    other.alias = 3;
    other.value.reset();
    EXPECT_EQ(why("press", sparkplug_payload(kNoon, {other}, {})), "the metric has no value");
    EXPECT_THAT(why("press", "{}"), HasSubstr("no payload of Sparkplug B"));
    EXPECT_THAT(why("press", payload, true), HasSubstr("must not be retained"));
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

/// What a payload with this one metric is parsed to.
std::optional<std::vector<ReceivedMetric>> parsed(ProtobufWriter& metric) {
    return parse_sparkplug(ProtobufWriter().bytes(2, metric.take()).take(), 1);
}

TEST(MqttSparkplugPayload, WhatIsNullHasNoValue) {
    ProtobufWriter behind, before;
    behind.bytes(1, "mode").varint(10, 9).varint(7, 1);
    before.bytes(1, "mode").varint(7, 1).varint(10, 9);
    for (ProtobufWriter* one : {&behind, &before}) {
        const auto heard = parsed(*one);
        ASSERT_TRUE(heard);
        EXPECT_EQ(heard->front().value, std::nullopt);
    }
}

TEST(MqttSparkplugPayload, TextIsUtf8) {
    ProtobufWriter good, bad, unnamed;
    EXPECT_TRUE(parsed(good.bytes(1, "name").bytes(15, "\xc3\xa4")));
    EXPECT_FALSE(parsed(bad.bytes(1, "name").bytes(15, "\xff\xfe")));
    EXPECT_FALSE(parsed(unnamed.bytes(1, "\xff").varint(10, 9)));
}

TEST(MqttSparkplugPayload, HasALimitOfMetrics) {
    const std::string payload = sparkplug_payload(kNoon, std::vector<Metric>(3), {});
    EXPECT_TRUE(parse_sparkplug(payload, 3));
    EXPECT_FALSE(parse_sparkplug(payload, 2));
}

TEST(MqttProtobuf, WritesWhatTheEncodingGuideShows) {
    EXPECT_EQ(hex(ProtobufWriter().varint(1, 150).take()), "089601");
    EXPECT_EQ(hex(ProtobufWriter().bytes(2, "testing").take()), "120774657374696e67");
    EXPECT_EQ(hex(ProtobufWriter().fixed32(16, 1).take()), "850101000000");
    EXPECT_EQ(hex(ProtobufWriter().fixed64(1, 1).take()), "090100000000000000");
}

TEST(MqttProtobuf, ReadsWhatItWrites) {
    constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
    const std::string text =
        ProtobufWriter().varint(1, kMost).fixed64(2, kMost - 1).fixed32(3, 7).bytes(4, "").take();
    ProtobufReader in(text);
    for (const std::uint64_t value : {kMost, kMost - 1, std::uint64_t{7}})
        EXPECT_EQ(in.next()->value, value);
    const auto last = in.next();
    EXPECT_TRUE(last->has_length);
    EXPECT_EQ(last->bytes, "");
    EXPECT_FALSE(in.next());
    EXPECT_TRUE(in.ok());
}

TEST(MqttProtobuf, WhatIsBrokenEndsThere) {
    for (const std::string_view text :
         {std::string_view("\x08"), std::string_view("\x08\x80"), std::string_view("\x12\x05hi"),
          std::string_view("\x09\x01\x02"), std::string_view("\x0d\x01"),
          std::string_view("\x00\x01", 2), std::string_view("\x0b\x01"),
          std::string_view("\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01")}) {
        ProtobufReader in(text);
        EXPECT_FALSE(in.next()) << hex(text);
        EXPECT_FALSE(in.ok()) << hex(text);
        EXPECT_FALSE(in.next());
    }
}

}  // namespace
}  // namespace panelgate::mqtt::sparkplug_test
