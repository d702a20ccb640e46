#include "panelgate/modbus/framing.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::modbus::mbap_test {
namespace {

const Bytes kRead = "00 10 00 00 00 06 11 03 00 6B 00 03"_hex;
const Bytes kOtherProtocol = "00 09 00 01 00 06 11 03 00 6B 00 03"_hex;

std::vector<MbapEvent> drain(MbapFramer& framer) {
    std::vector<MbapEvent> events;
    while (std::optional<MbapEvent> event = framer.next()) events.push_back(std::move(*event));
    return events;
}

std::vector<MbapEvent> all_of(ByteView bytes) {
    MbapFramer framer;
    framer.feed(bytes);
    return drain(framer);
}

Bytes operator+(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

TEST(Mbap, EncodesHeaderUnitAndPdu) {
    EXPECT_EQ(encode_mbap(0x0010, 0x11, "03 00 6B 00 03"_hex), kRead);
}

TEST(MbapFramer, GivesTransactionUnitAndPdu) {
    const std::vector<MbapEvent> events = all_of(kRead);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(std::get<Adu>(events[0]), (Adu{0x0010, 0x11, "03 00 6B 00 03"_hex}));
}

TEST(MbapFramer, WaitsForTheLastByte) {
    MbapFramer framer;
    EXPECT_FALSE(framer.partial());
    for (const std::uint8_t& byte : kRead) {
        EXPECT_FALSE(framer.next());
        framer.feed(ByteView(&byte, 1));
        EXPECT_EQ(framer.partial(), &byte != &kRead.back());
    }
    EXPECT_TRUE(framer.next());
    EXPECT_FALSE(framer.partial());
}

TEST(MbapFramer, TakesTheSmallestAndTheLargestAdu) {
    const Bytes smallest = encode_mbap(1, 2, Bytes(1, 7));
    const Bytes largest = encode_mbap(3, 4, Bytes(253, 0x15));
    EXPECT_EQ(largest.size(), kMaxTcpAdu);
    const std::vector<MbapEvent> events = all_of(smallest + largest);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(std::get<Adu>(events[0]), (Adu{1, 2, Bytes(1, 7)}));
    EXPECT_EQ(std::get<Adu>(events[1]), (Adu{3, 4, Bytes(253, 0x15)}));
}

TEST(MbapFramer, SkipsExactlyOneAduOfAnotherProtocol) {
    const std::vector<MbapEvent> events = all_of(kOtherProtocol + kRead);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_TRUE(std::holds_alternative<SkippedProtocol>(events[0]));
    EXPECT_EQ(std::get<Adu>(events[1]).transaction, 0x0010);
}

TEST(MbapFramer, IsBrokenByALengthOutsideTwoTo254) {
    for (const char* length : {"00 00", "00 01", "00 FF", "01 00", "01 06", "FF FF"}) {
        const Bytes header = "00 0A 00 00"_hex + from_hex(length).value();
        const std::vector<MbapEvent> events = all_of(kRead + header + kRead);
        ASSERT_EQ(events.size(), 2u) << length;
        EXPECT_TRUE(std::holds_alternative<Broken>(events[1])) << length;
    }
}

TEST(MbapFramer, IsBrokenByABadLengthOfAnotherProtocolToo) {
    const std::vector<MbapEvent> events = all_of("00 0A 00 01 00 00"_hex);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_TRUE(std::holds_alternative<Broken>(events[0]));
}

TEST(MbapFramer, TakesNothingMoreOnceItIsBroken) {
    MbapFramer framer;
    framer.feed("00 0A 00 00 00 00"_hex);
    EXPECT_EQ(drain(framer).size(), 1u);
    framer.feed(kRead);
    EXPECT_FALSE(framer.next());
    EXPECT_FALSE(framer.partial());
}

TEST(MbapFramer, IsNotPartialWhileAWholeAduWaitsToBeTaken) {
    MbapFramer framer;
    framer.feed(kRead + "00 11"_hex);
    EXPECT_FALSE(framer.partial());
    EXPECT_TRUE(framer.next());
    EXPECT_TRUE(framer.partial());
}

TEST(MbapFramer, GivesTheSameForEverySplit) {
    std::mt19937 random(2);
    Bytes stream;
    for (unsigned i = 0; i < 200; ++i) {
        Bytes adu = encode_mbap(static_cast<std::uint16_t>(i), 1, Bytes(1 + random() % 253, 0x41));
        if (random() % 5 == 0) adu[2] = 1;
        stream = stream + adu;
    }
    const std::vector<MbapEvent> whole = all_of(stream);
    ASSERT_EQ(whole.size(), 200u);
    for (int round = 0; round < 50; ++round) {
        MbapFramer framer;
        std::vector<MbapEvent> events;
        for (ByteView rest = stream; !rest.empty();) {
            const std::size_t size = std::min<std::size_t>(rest.size(), 1 + random() % 400);
            framer.feed(rest.first(size));
            rest = rest.subspan(size);
            const std::vector<MbapEvent> more = drain(framer);
            events.insert(events.end(), more.begin(), more.end());
        }
        ASSERT_EQ(events, whole);
    }
}

}  // namespace
}  // namespace panelgate::modbus::mbap_test
