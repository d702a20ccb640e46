#include "panelgate/modbus/framing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::framing_test {
namespace {

const Bytes kRead = "00 10 00 00 00 06 11 03 00 6B 00 03"_hex;
const Bytes kReadPdu = "03 0000 000A"_hex;
const Bytes kWritePdu = "10 0000 0002 04 0001 0002"_hex;

Bytes operator+(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

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

TEST(Mbap, IsHeaderUnitAndPdu) {
    EXPECT_EQ(encode_mbap(0x0010, 0x11, "03 00 6B 00 03"_hex), kRead);
    EXPECT_EQ(all_of(kRead), (std::vector<MbapEvent>{Adu{0x0010, 0x11, "03 00 6B 00 03"_hex}}));
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
    framer.feed(kRead + "00 11"_hex);
    EXPECT_FALSE(framer.partial()) << "a whole ADU waits to be taken";
    EXPECT_TRUE(framer.next());
    EXPECT_TRUE(framer.partial());
}

TEST(MbapFramer, TakesTheSmallestAndTheLargestAdu) {
    const Bytes largest = encode_mbap(3, 4, Bytes(253, 0x15));
    EXPECT_EQ(largest.size(), kMaxTcpAdu);
    EXPECT_EQ(all_of(encode_mbap(1, 2, Bytes(1, 7)) + largest),
              (std::vector<MbapEvent>{Adu{1, 2, Bytes(1, 7)}, Adu{3, 4, Bytes(253, 0x15)}}));
}

TEST(MbapFramer, SkipsExactlyOneAduOfAnotherProtocol) {
    const auto events = all_of("00 09 00 01 00 06 11 03 00 6B 00 03"_hex + kRead);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_TRUE(std::holds_alternative<SkippedProtocol>(events[0]));
    EXPECT_EQ(std::get<Adu>(events[1]).transaction, 0x0010);
}

TEST(MbapFramer, IsBrokenByALengthOutsideTwoTo254) {
    for (const Bytes& length :
         {"00 00"_hex, "00 01"_hex, "00 FF"_hex, "01 00"_hex, "01 06"_hex, "FF FF"_hex}) {
        MbapFramer framer;
        framer.feed(kRead + "00 0A 00 00"_hex + length + kRead);
        const std::vector<MbapEvent> events = drain(framer);
        ASSERT_EQ(events.size(), 2u) << to_hex(length);
        EXPECT_TRUE(std::holds_alternative<Broken>(events[1])) << to_hex(length);
        framer.feed(kRead);
        EXPECT_FALSE(framer.next()) << "it takes nothing more";
        EXPECT_FALSE(framer.partial());
    }
    EXPECT_EQ(all_of("00 0A 00 01 00 00"_hex), (std::vector<MbapEvent>{Broken{}}))
        << "of another protocol, too";
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
            for (MbapEvent& event : drain(framer)) events.push_back(std::move(event));
        }
        ASSERT_EQ(events, whole);
    }
}

TEST(Framing, HasTheWordsOfTheConfiguration) {
    EXPECT_EQ(label(Framing::tcp), "tcp");
    EXPECT_EQ(label(Framing::rtu), "rtu");
    EXPECT_EQ(label(Framing::ascii), "ascii");
}

TEST(Framing, EachEncodesAnExceptionInItsOwnFormat) {
    EXPECT_EQ(encode_reply(Framing::tcp, 7, 17, "83 0A"_hex), "0007 0000 0003 11 83 0A"_hex);
    EXPECT_EQ(encode_reply(Framing::rtu, 7, 17, "83 0A"_hex), "11 83 0A C0 F2"_hex);
    EXPECT_EQ(encode_reply(Framing::ascii, 7, 17, "83 0A"_hex), encode_ascii(17, "83 0A"_hex));
}

TEST(Framing, OnlyOverTcpIsABroadcastAnswered) {
    EXPECT_TRUE(is_answered(Framing::tcp, 0));
    EXPECT_FALSE(is_answered(Framing::rtu, 0));
    EXPECT_FALSE(is_answered(Framing::ascii, 0));
    EXPECT_TRUE(is_answered(Framing::rtu, 1));
}

TEST(OtherFraming, OneThatSpeaksRtuIsRecognised) {
    // The last has an MBAP header in it that is right: length 2, function 0B of unit C4.
    for (const Bytes& pdu : {"03 0064 0005"_hex, kReadPdu, "01 0000 0001"_hex, "03 0000 0002"_hex,
                             kWritePdu, "11"_hex}) {
        const Bytes one = encode_adu(1, pdu);
        EXPECT_EQ(other_framing(Framing::tcp, one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::tcp, one + one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::ascii, one), Framing::rtu) << to_hex(one);
        EXPECT_EQ(other_framing(Framing::rtu, one), std::nullopt);
    }
    EXPECT_EQ(other_framing(Framing::tcp, encode_adu(0, "06 0000 0001"_hex)), Framing::rtu);
}

TEST(OtherFraming, OneThatSpeaksAsciiOrModbusTcpIsRecognised) {
    const Bytes text = encode_ascii(1, kReadPdu);
    EXPECT_EQ(other_framing(Framing::tcp, text), Framing::ascii);
    EXPECT_EQ(other_framing(Framing::rtu, text), Framing::ascii);
    EXPECT_EQ(other_framing(Framing::ascii, text), std::nullopt);
    const Bytes one = encode_mbap(1, 1, kReadPdu);
    const Bytes pipelined = one + encode_mbap(2, 1, "06 0001 0002"_hex);
    for (const Bytes& tcp : {one, pipelined}) {
        EXPECT_EQ(other_framing(Framing::rtu, tcp), Framing::tcp) << to_hex(tcp);
        EXPECT_EQ(other_framing(Framing::ascii, tcp), Framing::tcp) << to_hex(tcp);
    }
    EXPECT_EQ(other_framing(Framing::tcp, one), std::nullopt);
}

TEST(OtherFraming, NoTransactionIdMakesAGoodAduSuspicious) {
    for (unsigned transaction = 0; transaction < 0x10000; ++transaction) {
        const auto id = static_cast<std::uint16_t>(transaction);
        for (const Bytes& adu : {encode_mbap(id, 1, kReadPdu), encode_mbap(id, 5, kWritePdu)})
            ASSERT_EQ(other_framing(Framing::tcp, adu), std::nullopt) << transaction;
    }
}

TEST(OtherFraming, ADamagedOrHalfSentFrameIsNotSure) {
    const Bytes good = encode_adu(1, "03 0064 0005"_hex);
    for (std::size_t size = 0; size < good.size(); ++size)
        EXPECT_EQ(other_framing(Framing::tcp, ByteView(good).first(size)), std::nullopt);
    Bytes bad = good;
    bad.back() ^= 1;
    EXPECT_EQ(other_framing(Framing::tcp, bad), std::nullopt);
}

/// As far as they have come: a damaged request that is repeated, and a write.
TEST(OtherFraming, RequestsInRtuAreNoModbusTcp) {
    const Bytes read = encode_adu(1, "03 0000 0006"_hex);
    Bytes damaged = read;
    damaged[6] ^= 0x10;
    for (const Bytes& bytes : {damaged + read, encode_adu(1, kWritePdu)}) {
        for (std::size_t size = 0; size <= bytes.size(); ++size)
            EXPECT_EQ(other_framing(Framing::rtu, ByteView(bytes).first(size)), std::nullopt)
                << size;
    }
}

}  // namespace
}  // namespace panelgate::modbus::framing_test
