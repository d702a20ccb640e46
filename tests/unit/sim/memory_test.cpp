#include "memory.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace panelgate::sim::memory_test {
namespace {

using modbus::Table;

/// Words 100 to 109, whose bits are coils, and 20 coils of their own.
profile::PanelProfile panel() {
    profile::PanelProfile profile;
    profile.areas.resize(3);
    profile.areas[0].name = "W";
    profile.areas[0].readable = {100, 109};
    profile.areas[1].name = "B";
    profile.areas[1].table = Table::coils;
    profile.areas[1].readable = {1600, 1759};
    profile.areas[1].view_of = "W";
    profile.areas[2].name = "R";
    profile.areas[2].table = Table::coils;
    profile.areas[2].readable = {0, 19};
    return profile;
}

class MemoryTest : public ::testing::Test {
  protected:
    const profile::PanelProfile profile = panel();
    const profile::Area& words = profile.areas[0];
    const profile::Area& bits = profile.areas[1];
    const profile::Area& relays = profile.areas[2];
    Memory memory{profile};
};

TEST_F(MemoryTest, BeginsWithZeros) {
    EXPECT_EQ(memory.get(words, 100), 0);
    EXPECT_EQ(memory.get(words, 109), 0);
    EXPECT_EQ(memory.get(bits, 1759), 0);
    EXPECT_EQ(memory.get(relays, 19), 0);
}

TEST_F(MemoryTest, AWordKeepsAllItsBits) {
    memory.set(words, 100, 0xFFFF);
    memory.set(words, 109, 0x8001);
    EXPECT_EQ(memory.get(words, 100), 0xFFFF);
    EXPECT_EQ(memory.get(words, 101), 0);
    EXPECT_EQ(memory.get(words, 109), 0x8001);
}

TEST_F(MemoryTest, ABitIsOneForAnythingButZero) {
    memory.set(relays, 3, 0xFF00);
    EXPECT_EQ(memory.get(relays, 3), 1);
    EXPECT_EQ(memory.get(relays, 2), 0);
    memory.set(relays, 3, 0);
    EXPECT_EQ(memory.get(relays, 3), 0);
}

TEST_F(MemoryTest, BitNOfAViewIsBitNModulo16OfWordNDividedBy16) {
    memory.set(words, 101, 0x8002);
    EXPECT_EQ(memory.get(bits, 16 * 101 + 1), 1);
    EXPECT_EQ(memory.get(bits, 16 * 101 + 15), 1);
    EXPECT_EQ(memory.get(bits, 16 * 101), 0);
    EXPECT_EQ(memory.get(bits, 16 * 100 + 15), 0);
}

TEST_F(MemoryTest, WritingABitOfAViewLeavesTheOthersOfItsWord) {
    memory.set(words, 102, 0x00F0);
    memory.set(bits, 16 * 102 + 4, 0);
    memory.set(bits, 16 * 102 + 15, 0xFF00);
    EXPECT_EQ(memory.get(words, 102), 0x80E0);
    EXPECT_EQ(memory.get(relays, 4), 0) << "coils that are no view are apart";
}

}  // namespace
}  // namespace panelgate::sim::memory_test
