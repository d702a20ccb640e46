#include "panelgate/sim/misbehaviour.hpp"

#include <gtest/gtest.h>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/sim/station.hpp"
#include "support/hex.hpp"

namespace panelgate::sim::misbehaviour_test {
namespace {

const Bytes kReply = modbus::encode_adu(20, "03 02 00 07"_hex);

Spoken once(const Misbehaviour& faults) {
    std::mt19937 chance(1);
    return misbehave(faults, kReply, chance);
}

TEST(Misbehaviour, NoneLeavesTheReplyAsItIs) {
    EXPECT_EQ(once({}).adu, kReply);
    EXPECT_EQ(once({}).delay, Duration::zero());
}

TEST(Misbehaviour, EachFaultHasTheEffectOfItsName) {
    Misbehaviour faults;
    faults.dead = true;
    EXPECT_TRUE(once(faults).adu.empty());
    faults = {};
    faults.drop = 1;
    EXPECT_TRUE(once(faults).adu.empty());
    faults = {};
    faults.slow = 20ms;
    faults.late = 1;
    faults.late_by = 600ms;
    EXPECT_EQ(once(faults).delay, Duration(620ms));
    EXPECT_EQ(once(faults).adu, kReply);
    faults = {};
    faults.damage = 1;
    EXPECT_FALSE(modbus::crc_ok(once(faults).adu));
    EXPECT_EQ(once(faults).adu.size(), kReply.size());
    faults = {};
    faults.truncate = 1;
    EXPECT_EQ(once(faults).adu, Bytes(kReply.begin(), kReply.begin() + 4));
    faults = {};
    faults.foreign_id = 1;
    EXPECT_EQ(once(faults).adu[0], 21);
    EXPECT_TRUE(modbus::crc_ok(once(faults).adu));
}

TEST(Misbehaviour, IsEncodedInTheModeOfTheLine) {
    const SerialFormat format{9600, 7, Parity::even, 1, SerialMode::ascii};
    std::mt19937 chance(1);
    const Bytes good = modbus::to_ascii(kReply);
    EXPECT_EQ(misbehave({}, kReply, chance, format).adu, good);
    Misbehaviour faults;
    faults.damage = 1;
    const Bytes damaged = misbehave(faults, kReply, chance, format).adu;
    EXPECT_EQ(damaged.size(), good.size());
    EXPECT_NE(damaged, good);
    faults = {};
    faults.foreign_id = 1;
    EXPECT_EQ(misbehave(faults, kReply, chance, format).adu,
              modbus::encode_ascii(21, "03 02 00 07"_hex));
}

TEST(Misbehaviour, AShareIsOfManyAnswers) {
    Misbehaviour faults;
    faults.drop = 0.25;
    std::mt19937 chance(7);
    int silent = 0;
    for (int i = 0; i < 10'000; ++i) silent += misbehave(faults, kReply, chance).adu.empty();
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

TEST(Misbehaviour, OnlyThePanasonicMindsAPauseOfMoreThan24BitTimes) {
    const profile::Catalogue shipped = profile::Catalogue::shipped();
    const SerialFormat format{9600, 8, Parity::none, 1};
    const Duration bits24 = Duration(1s) * 24 / 9600;
    const Station gt(*shipped.find("panasonic-gt"), 20);
    EXPECT_FALSE(gt.rejects_gap(bits24, format));
    EXPECT_TRUE(gt.rejects_gap(bits24 + 1us, format));
    const Station gp(*shipped.find("autonics-gplp-s"), 31);
    EXPECT_FALSE(gp.rejects_gap(1s, format));
}

}  // namespace
}  // namespace panelgate::sim::misbehaviour_test
