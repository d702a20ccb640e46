#include "sparkplug_payload.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <limits>

#include "mqtt_plant.hpp"

namespace panelgate::mqtt::protobuf_test {
namespace {

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
    EXPECT_EQ(in.next()->value, kMost);
    EXPECT_EQ(in.next()->value, kMost - 1);
    EXPECT_EQ(in.next()->value, 7U);
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
}  // namespace panelgate::mqtt::protobuf_test
