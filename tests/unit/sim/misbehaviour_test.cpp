#include "panelgate/sim/misbehaviour.hpp"

#include <gtest/gtest.h>

#include <random>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::sim::misbehaviour_test {
namespace {

const SerialFormat k8n1{38400, 8, Parity::none, 1};
const SerialFormat k8e1{9600, 8, Parity::even, 1};
const SerialFormat kAscii{9600, 7, Parity::even, 1, SerialMode::ascii};
const Bytes kPdu = "03 02 12 34"_hex;
const Bytes kReply = modbus::encode_adu(7, kPdu);

Spoken once(const Misbehaviour& faults, const SerialFormat& format = {}) {
    std::mt19937 chance(1);
    return misbehave(faults, kReply, chance, format);
}

TEST(Misbehaviour, EachFaultHasTheEffectOfItsName) {
    EXPECT_EQ(once({}).adu, kReply);
    EXPECT_EQ(once({}).delay, Duration::zero());
    EXPECT_TRUE(once({.dead = true}).adu.empty());
    EXPECT_TRUE(once({.drop = 1}).adu.empty());
    const Spoken late = once({.slow = 20ms, .late_by = 600ms, .late = 1});
    EXPECT_EQ(late.delay, Duration(620ms));
    EXPECT_EQ(late.adu, kReply);
    const Bytes damaged = once({.damage = 1}).adu;
    EXPECT_FALSE(modbus::crc_ok(damaged));
    EXPECT_EQ(damaged.size(), kReply.size());
    EXPECT_EQ(once({.truncate = 1}).adu, Bytes(kReply.begin(), kReply.begin() + 4));
    EXPECT_EQ(once({.foreign_id = 1}).adu, modbus::encode_adu(8, kPdu));
}

TEST(Misbehaviour, IsEncodedInTheModeOfTheLine) {
    const Bytes good = modbus::to_ascii(kReply);
    EXPECT_EQ(once({}, kAscii).adu, good);
    const Bytes damaged = once({.damage = 1}, kAscii).adu;
    EXPECT_EQ(damaged.size(), good.size());
    EXPECT_NE(damaged, good);
    EXPECT_EQ(once({.foreign_id = 1}, kAscii).adu, modbus::encode_ascii(8, kPdu));
}

TEST(Misbehaviour, AShareIsOfManyAnswers) {
    std::mt19937 chance(7);
    int silent = 0;
    for (int i = 0; i < 10'000; ++i)
        silent += misbehave({.drop = 0.25}, kReply, chance).adu.empty() ? 1 : 0;
    EXPECT_NEAR(silent, 2500, 200);
}

TEST(Misbehaviour, ConvertsFromAndToNumbers) {
    Misbehaviour faults;
    const FaultNumbers numbers{{"dead", 1}, {"slow_ms", 20}, {"late_by_ms", 600}, {"late", 0.5}};
    EXPECT_FALSE(from_numbers(numbers, faults));
    EXPECT_TRUE(faults.dead);
    EXPECT_EQ(faults.late_by, Duration(600ms));
    const FaultNumbers told = to_numbers(faults);
    EXPECT_EQ(told.size(), 9u);
    for (const auto& [name, value] : numbers) EXPECT_EQ(told.at(name), value) << name;
    EXPECT_EQ(from_numbers({{"drop", 1.5}}, faults), "drop must be from 0 to 1, not 1.5");
    EXPECT_EQ(from_numbers({{"dread", 1}}, faults),
              "there is no fault 'dread'; did you mean 'dead'?");
    EXPECT_EQ(
        from_numbers({{"asleep", 1}}, faults),
        "there is no fault 'asleep'; faults are dead, slow_ms, late_by_ms, late, drop, damage, "
        "truncate, foreign_id, duplicate");
    EXPECT_TRUE(faults.dead) << "a bad set changes nothing";
}

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
    std::mt19937 chance(3);
    int doubled = 0;
    int damaged = 0;
    constexpr int kReplies = 3000;
    for (int i = 0; i < kReplies; ++i) {
        const Spoken spoken = misbehave({.duplicate = 1}, kReply, chance, k8n1);
        ASSERT_EQ(spoken.ends.size(), spoken.adu.size());
        doubled += spoken.adu == twice(kReply) ? 1 : 0;
        damaged += spoken.adu != twice(kReply) && spoken.adu != kReply ? 1 : 0;
    }
    EXPECT_NEAR(doubled, kReplies / 3, kReplies / 20);
    EXPECT_NEAR(damaged, kReplies * 2 / 3, kReplies / 20);
}

}  // namespace
}  // namespace panelgate::sim::misbehaviour_test
