#include "panelgate/sim/misbehaviour.hpp"

#include <gtest/gtest.h>

#include <random>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::sim::collision_test {
namespace {

const SerialFormat k8n1{38400, 8, Parity::none, 1};
const SerialFormat k8e1{9600, 8, Parity::even, 1};
const Bytes kReply = modbus::encode_adu(7, "03 02 12 34"_hex);

Bytes twice(const Bytes& bytes) {
    Bytes both = bytes;
    both.insert(both.end(), bytes.begin(), bytes.end());
    return both;
}

TEST(Collision, TwoEqualRepliesAtOnceAreOne) {
    const HeardBytes heard = collide(kReply, kReply, 0, k8n1);
    EXPECT_EQ(heard.bytes, kReply);
    EXPECT_EQ(heard.ends.front(), 10u);
    EXPECT_EQ(heard.ends.back(), 70u);
}

TEST(Collision, OneAfterTheOtherBothComeCleanWithThePauseBetweenThem) {
    for (const SerialFormat& format : {k8n1, k8e1}) {
        const auto bits = static_cast<std::uint32_t>(format.bits_per_character());
        const HeardBytes heard = collide(kReply, kReply, std::size_t{7} * bits + 5, format);
        EXPECT_EQ(heard.bytes, twice(kReply));
        EXPECT_EQ(heard.ends[7], 8 * bits + 5);
    }
}

TEST(Collision, WhatOverlapsIsGarbledAndWhatDoesNotIsClean) {
    const HeardBytes heard = collide(kReply, kReply, 30, k8n1);  // three characters later
    ASSERT_EQ(heard.bytes.size(), 10u);
    EXPECT_EQ(Bytes(heard.bytes.begin(), heard.bytes.begin() + 3), "07 03 02"_hex);
    EXPECT_EQ(heard.bytes[3], 0x12 & 0x07);
    EXPECT_EQ(Bytes(heard.bytes.end() - 3, heard.bytes.end()),
              Bytes(kReply.end() - 3, kReply.end()));
}

TEST(Collision, ADuplicatePanelComesTwiceADamagedOrASingleTime) {
    Misbehaviour faults;
    faults.duplicate = 1;
    std::mt19937 chance(3);
    int doubled = 0;
    int damaged = 0;
    constexpr int kReplies = 3000;
    for (int i = 0; i < kReplies; ++i) {
        const Spoken spoken = misbehave(faults, kReply, chance, k8n1);
        ASSERT_EQ(spoken.ends.size(), spoken.adu.size());
        doubled += spoken.adu == twice(kReply) ? 1 : 0;
        damaged += spoken.adu != twice(kReply) && spoken.adu != kReply ? 1 : 0;
    }
    EXPECT_NEAR(doubled, kReplies / 3, kReplies / 20);
    EXPECT_NEAR(damaged, kReplies * 2 / 3, kReplies / 20);
}

}  // namespace
}  // namespace panelgate::sim::collision_test
