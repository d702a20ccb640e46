#include "attempt.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <random>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::scan::heard_test {
namespace {

const Bytes kReply = modbus::encode_adu(7, "03 02 00 05"_hex);

Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

TEST(TakeApart, FindsRequestsAndRepliesBetweenNoise) {
    const Bytes request = modbus::encode_adu(3, "04 00 10 00 02"_hex);
    const Bytes write = modbus::encode_adu(0, "10 00 01 00 01 02 00 05"_hex);
    const Heard heard = extract_frames(joined({"AB"_hex, request, kReply, "CD EF"_hex, write}));
    ASSERT_EQ(heard.frames.size(), 3u);
    EXPECT_EQ(heard.damaged, 3u);
    EXPECT_EQ(heard.frames[0].pdu, "04 00 10 00 02"_hex);
    EXPECT_EQ(heard.frames[2].station, 0);
    EXPECT_TRUE(extract_frames({}).frames.empty());
}

TEST(TakeApart, AFrameThatIsCutOffIsDamageAndHidesNoOther) {
    const Bytes cut(kReply.begin(), kReply.end() - 1);
    const Heard heard = extract_frames(joined({cut, kReply, cut}));
    ASSERT_EQ(heard.frames.size(), 1u);
    EXPECT_EQ(heard.frames[0].station, 7);
    EXPECT_EQ(heard.frames[0].pdu, "03 02 00 05"_hex);
    EXPECT_EQ(heard.damaged, 2 * cut.size());
}

TEST(TakeApart, AnExceptionIsAFrame) {
    const Heard heard = extract_frames(modbus::encode_adu(7, "83 02"_hex));
    ASSERT_EQ(heard.frames.size(), 1u);
    EXPECT_EQ(heard.frames[0].pdu, "83 02"_hex);
}

TEST(TakeApart, WhatNobodyOnALineSaysIsNoFrameHoweverGoodItsCrc) {
    for (const Bytes& adu :
         {modbus::encode_adu(248, "03 02 00 05"_hex), modbus::encode_adu(7, "41 02 00 05"_hex),
          modbus::encode_adu(0, "03 00 00 00 01"_hex)}) {
        const Heard heard = extract_frames(adu);
        EXPECT_TRUE(heard.frames.empty()) << to_hex(adu);
        EXPECT_EQ(heard.damaged, adu.size());
    }
}

TEST(TakeApart, EveryByteIsInAFrameOrDamaged) {
    std::mt19937 random(5);
    for (int i = 0; i < 2000; ++i) {
        Bytes noise(random() % 40);
        for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
        const Bytes bytes = joined({noise, kReply, noise});
        const Heard heard = extract_frames(bytes);
        std::size_t framed = 0;
        for (const Frame& frame : heard.frames) framed += frame.pdu.size() + 3;
        ASSERT_EQ(framed + heard.damaged, bytes.size()) << to_hex(bytes);
    }
}

}  // namespace
}  // namespace panelgate::scan::heard_test
