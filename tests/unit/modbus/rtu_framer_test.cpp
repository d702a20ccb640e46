#include "panelgate/modbus/rtu_framer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::modbus::rtu_framer_test {
namespace {

const Bytes kRequest = "03 00 6B 00 03"_hex;
const Bytes kReplyPdu = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kReply = "11 03 06 02 2B 00 00 00 64 C8 BA"_hex;

Bytes joined(Bytes front, const Bytes& back) {
    front.insert(front.end(), back.begin(), back.end());
    return front;
}

/// The procedure of serial line V1.02, 6.2.2, a bit at a time.
std::uint16_t slow_crc(ByteView bytes) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            const bool carry = (crc & 1) != 0;
            crc >>= 1;
            if (carry) crc ^= 0xA001;
        }
    }
    return static_cast<std::uint16_t>(crc);
}

TEST(Crc16, GivesTheValuesOfTheStandard) {
    EXPECT_EQ(crc16("31 32 33 34 35 36 37 38 39"_hex), 0x4B37) << "check value of the algorithm";
    EXPECT_EQ(crc16("02 07"_hex), 0x1241) << "example of the serial line guide";
    EXPECT_EQ(crc16({}), 0xFFFF);
    EXPECT_EQ(crc16("02 07 41 12"_hex), 0) << "over a frame with its CRC";
}

TEST(Crc16, AgreesWithTheBitwiseProcedure) {
    std::mt19937 random(1);
    for (std::size_t size = 0; size < 300; ++size) {
        Bytes bytes(size);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        ASSERT_EQ(crc16(bytes), slow_crc(bytes)) << to_hex(bytes);
    }
}

TEST(RtuFrame, IsAtLeastFourBytesWithTheLowByteOfTheCrcFirst) {
    EXPECT_EQ(encode_adu(0x02, "07"_hex), "02 07 41 12"_hex);
    EXPECT_TRUE(crc_ok("02 07 41 12"_hex));
    EXPECT_FALSE(crc_ok("02 07 12 41"_hex));
    EXPECT_FALSE(crc_ok({}));
    EXPECT_FALSE(crc_ok("FF"_hex));
    EXPECT_FALSE(crc_ok("FF FF"_hex)) << "the residue of nothing is not a frame";
    EXPECT_FALSE(crc_ok("02 3E 81"_hex));
    const Bytes longest = encode_adu(0x14, Bytes(257, 0x55));
    EXPECT_EQ(longest.size(), 260u);
    EXPECT_TRUE(crc_ok(longest)) << "there is no upper limit here";
    EXPECT_FALSE(decode_adu("02 07 41 13"_hex));
}

TEST(RtuFrame, ComesApartIntoStationAndPdu) {
    const Bytes adu = "11 03 00 6B 00 03 76 87"_hex;
    const std::optional<RtuFrame> frame = decode_adu(adu);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->station, 0x11);
    EXPECT_EQ(Bytes(frame->pdu.begin(), frame->pdu.end()), "03 00 6B 00 03"_hex);
}

TEST(CrcOrder, HighFirstIsTheSameCrcInReverseOrderAndGoodInItsOwnOnly) {
    const Bytes old = encode_adu(0x11, kReplyPdu, CrcOrder::high_first);
    EXPECT_EQ(old, "11 03 06 02 2B 00 00 00 64 BA C8"_hex);
    Bytes swapped = old;
    std::swap(swapped[swapped.size() - 2], swapped.back());
    EXPECT_EQ(swapped, encode_adu(0x11, kReplyPdu));
    EXPECT_TRUE(crc_ok(old, CrcOrder::high_first));
    EXPECT_FALSE(crc_ok(old));
    EXPECT_FALSE(crc_ok(swapped, CrcOrder::high_first));
    EXPECT_FALSE(crc_ok("11 03 06"_hex, CrcOrder::high_first)) << "no frame is so short";
}

TEST(CrcOrder, EachAddressOfALineHasItsOwn) {
    CrcOrders orders;
    orders.set(5, CrcOrder::high_first);
    EXPECT_EQ(orders.of(5), CrcOrder::high_first);
    EXPECT_EQ(orders.of(6), CrcOrder::low_first);
    EXPECT_TRUE(crc_ok(encode_adu(5, kReplyPdu, CrcOrder::high_first), orders));
    EXPECT_FALSE(crc_ok(encode_adu(5, kReplyPdu), orders));
    EXPECT_TRUE(crc_ok(encode_adu(6, kReplyPdu), orders));
    EXPECT_FALSE(crc_ok({}, orders));
}

class RtuFramer : public ::testing::Test {
  protected:
    std::size_t unused_bytes() {
        std::size_t unused = 0;
        for (const Unused& part : framer.take_unused()) unused += part.bytes.size();
        return unused;
    }
    ReplyFramer framer{0x11, kRequest};
};

TEST_F(RtuFramer, GivesTheReplyAtItsLastByteHoweverItIsCut) {
    for (std::size_t piece = 1; piece <= kReply.size(); ++piece) {
        ReplyFramer one(0x11, kRequest);
        std::optional<Bytes> reply;
        for (std::size_t at = 0; at < kReply.size(); at += piece) {
            EXPECT_FALSE(reply);
            reply = one.feed(ByteView(kReply).subspan(at, std::min(piece, kReply.size() - at)));
        }
        EXPECT_EQ(reply, kReplyPdu);
    }
}

TEST_F(RtuFramer, ReportsTheMinimumOfMissingBytesAndThoseOfNoException) {
    // Bytes, what is missing at least, and if it is no exception.
    for (const auto& [bytes, missing, as_asked] :
         {std::tuple(""_hex, 0u, 0u), std::tuple("11"_hex, 2u, 10u), std::tuple("03"_hex, 1u, 9u),
          std::tuple("06"_hex, 8u, 8u), std::tuple("02 2B 00 00 00 64 C8"_hex, 1u, 1u)}) {
        framer.feed(bytes);
        EXPECT_EQ(framer.missing(), missing) << to_hex(bytes);
        EXPECT_EQ(framer.missing_as_asked(), as_asked) << to_hex(bytes);
    }
    framer.feed("BA"_hex);
    EXPECT_EQ(framer.missing(), 0u);
    ReplyFramer other_count(0x11, kRequest);
    other_count.feed("11 03 04"_hex);
    EXPECT_EQ(other_count.missing_as_asked(), other_count.missing()) << "it says so itself";
    ReplyFramer refused(0x11, kRequest);
    refused.feed("11 83"_hex);
    EXPECT_EQ(refused.missing_as_asked(), 1u);
    ReplyFramer foreign(0x11, kRequest);
    foreign.feed("12"_hex);
    EXPECT_EQ(foreign.missing_as_asked(), 0u);
}

TEST_F(RtuFramer, WithoutAReplyEveryByteMayDecide) {
    framer.feed("22 03 06"_hex);
    EXPECT_EQ(framer.missing(), 0u);
    framer.feed("11 03 04"_hex);
    EXPECT_EQ(framer.missing(), 0u) << "a byte count that does not answer";
}

TEST_F(RtuFramer, TakesAnExceptionBeforeItLooksAtAnyByteCount) {
    EXPECT_EQ(framer.feed("11 83 02 C1 34"_hex), "83 02"_hex);
}

TEST_F(RtuFramer, StillTakesTheRightReplyAfterWhatIsNone) {
    for (const Bytes& heard : {"11 03 06 02 2B 00 00 00 64 BA C8"_hex,  // the CRC's bytes swapped
                               "11 03 06 03 2B 00 00 00 64 C8 BA"_hex,  // a bit
                               "11 03 06 02 2B 00 00"_hex,              // truncated
                               "12 03 06 02 2B 00 00 00 64 DC 4A"_hex,  // station
                               "11 04 06 02 2B 00 00 00 64 89 5C"_hex,  // function
                               // The length of an older request.
                               "11 03 0A 00 01 00 02 00 03 00 04 00 05 F1 B4"_hex}) {
        SCOPED_TRACE(to_hex(heard));
        EXPECT_FALSE(framer.feed(heard));
        EXPECT_FALSE(framer.on_silence());
        EXPECT_FALSE(framer.has_pending());
        EXPECT_EQ(framer.feed(kReply), kReplyPdu);
        EXPECT_EQ(unused_bytes(), heard.size());
        framer = ReplyFramer(0x11, kRequest);
    }
}

TEST_F(RtuFramer, NamesWhatItSteppedOver) {
    EXPECT_FALSE(framer.feed("12 03 06 02 2B 00 00 00 64 DC 4A"_hex));
    EXPECT_EQ(framer.feed(kReply), kReplyPdu);
    const auto unused = framer.take_unused();
    ASSERT_EQ(unused.size(), 1u);
    EXPECT_EQ(unused[0].kind, Unused::Kind::foreign);
    EXPECT_EQ(unused[0].station, 0x12);
    EXPECT_FALSE(framer.was_damaged());
}

TEST_F(RtuFramer, ADamagedReplyIsNotSilence) {
    framer.feed("11 03 06 03 2B 00 00 00 64 C8 BA"_hex);
    EXPECT_TRUE(framer.has_pending());
    framer.on_silence();
    EXPECT_TRUE(framer.was_damaged());
}

TEST_F(RtuFramer, StepsOverNoiseOfAnyKindInFrontAndBehind) {
    std::mt19937 random(7);
    for (int round = 0; round < 2000; ++round) {
        ReplyFramer one(0x11, kRequest);
        Bytes heard(random() % 65);
        for (std::uint8_t& byte : heard) {
            // Anything but the station's address: a start that looks like ours waits for silence.
            byte = static_cast<std::uint8_t>(random());
            if (byte == 0x11) byte = 0;
        }
        heard.insert(heard.end(), kReply.begin(), kReply.end());
        const std::size_t tail = random() % 4;
        for (std::size_t i = 0; i < tail; ++i) heard.push_back(random() % 2 == 0 ? 0x00 : 0xFF);
        auto reply = one.feed(heard);
        if (!reply && one.is_inside()) reply = one.on_silence();
        ASSERT_EQ(reply, kReplyPdu) << to_hex(heard);
    }
}

TEST_F(RtuFramer, TheReplyBehindWhatLooksLikeAStartWaitsForASilenceAtMost) {
    auto reply = framer.feed(joined("11 03"_hex, kReply));
    if (!reply) reply = framer.on_silence();
    EXPECT_EQ(reply, kReplyPdu);
    ReplyFramer inside(0x11, kRequest);
    EXPECT_FALSE(inside.feed(joined("12 03 20"_hex, kReply)));
    EXPECT_TRUE(inside.is_inside());
    EXPECT_EQ(inside.on_silence(), kReplyPdu);
}

TEST_F(RtuFramer, P1DataOfAnotherFrameIsNoReply) {
    const Bytes reply = joined("03 0B"_hex, kReply);
    const Bytes write = joined("10 00 00 00 08 10 00 00 00 00 00"_hex, kReply);
    for (const Bytes& other : {encode_adu(0x12, reply),     // another station's
                               encode_adu(0x11, reply),     // its own, of another length
                               encode_adu(0x12, write)}) {  // another master's write
        ReplyFramer one(0x11, kRequest);
        for (std::size_t i = 0; i < other.size(); ++i)
            EXPECT_FALSE(one.feed(ByteView(other).subspan(i, 1))) << i;
        EXPECT_FALSE(one.on_silence());
        EXPECT_EQ(one.feed(kReply), kReplyPdu);
    }
}

TEST_F(RtuFramer, KeepsItsMemoryBoundedUnderEndlessNoise) {
    const Bytes noise(1000, 0x11);
    for (int i = 0; i < 1000; ++i) framer.feed(noise);
    framer.on_silence();
    EXPECT_LT(unused_bytes(), 200'000u);
    EXPECT_EQ(framer.feed(kReply), kReplyPdu);
}

TEST_F(RtuFramer, EveryOneBitDamageIsRejected) {
    for (std::size_t bit = 0; bit < kReply.size() * 8; ++bit) {
        ReplyFramer one(0x11, kRequest);
        Bytes damaged = kReply;
        damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
        EXPECT_FALSE(one.feed(damaged));
        EXPECT_FALSE(one.on_silence()) << "bit " << bit;
    }
}

TEST_F(RtuFramer, KnowsTheTwoByteCountOfReadFifoQueueAndTheLongFramesOfPanels) {
    ReplyFramer fifo(0x11, "18 04 DE"_hex);
    EXPECT_TRUE(fifo.feed("11 18 00 06 00 02 01 B8 12 84 18 8D"_hex));
    Bytes pdu{0x01, 255};
    pdu.resize(257, 0x55);
    ReplyFramer coils(20, "01 00 20 07 F8"_hex);
    EXPECT_EQ(coils.feed(encode_adu(20, pdu)), pdu);
}

TEST_F(RtuFramer, SilenceEndsADeviceIdentificationWithAWrongCount) {
    const Bytes pdu = "2B 0E 01 01 00 00 03 00 02 41 42 01 01 43"_hex;  // of 3 objects it has 2
    ReplyFramer asked(0x11, "2B 0E 01 00"_hex);
    EXPECT_FALSE(asked.feed(encode_adu(0x11, pdu)));
    EXPECT_EQ(asked.on_silence(), pdu);
}

/// Station 5 has the old order of the CRC, high byte first; station 6 the standard's.
class FramerOfBothOrders : public ::testing::Test {
  protected:
    FramerOfBothOrders() { orders.set(5, CrcOrder::high_first); }
    /// The reply to a read of `asked` among these bytes.
    std::optional<Bytes> found(std::uint8_t asked, const Bytes& bytes) const {
        return ReplyFramer(asked, kRequest, orders).feed(bytes);
    }
    CrcOrders orders;
    const Bytes old_reply = encode_adu(5, kReplyPdu, CrcOrder::high_first);
    const Bytes new_reply = encode_adu(6, kReplyPdu);
};

TEST_F(FramerOfBothOrders, P1AReplyCountsInTheOrderOfItsStationOnly) {
    EXPECT_EQ(found(5, encode_adu(5, kReplyPdu)), std::nullopt);
    EXPECT_EQ(found(5, old_reply), kReplyPdu);
    EXPECT_EQ(found(6, new_reply), kReplyPdu);
    EXPECT_EQ(found(6, encode_adu(6, kReplyPdu, CrcOrder::high_first)), std::nullopt);
}

TEST_F(FramerOfBothOrders, P1AFrameOfTheOtherOrderInFrontIsSkippedWhole) {
    for (const auto& [asked, mine, theirs] : {std::tuple(std::uint8_t{6}, new_reply, old_reply),
                                              std::tuple(std::uint8_t{5}, old_reply, new_reply)}) {
        ReplyFramer framer(asked, kRequest, orders);
        EXPECT_EQ(framer.feed(joined(theirs, mine)), kReplyPdu);
        const auto unused = framer.take_unused();
        ASSERT_EQ(unused.size(), 1u);
        EXPECT_EQ(unused[0].kind, Unused::Kind::foreign);
        EXPECT_EQ(unused[0].bytes, theirs);
        EXPECT_FALSE(framer.was_damaged());
    }
}

TEST_F(RtuFramer, WhatBeginsBehindTheReplyLikeAnotherOneIsKeptForItsRest) {
    const Bytes reply = encode_adu(5, kReplyPdu);
    for (std::size_t begun = 1; begun < reply.size(); ++begun) {
        ReplyFramer framer(5, kRequest);
        Bytes heard = reply;
        heard.insert(heard.end(), reply.begin(), reply.begin() + static_cast<int>(begun));
        ASSERT_EQ(framer.feed(heard), kReplyPdu);
        EXPECT_TRUE(framer.has_pending());
        EXPECT_TRUE(framer.knows_length());
        EXPECT_EQ(framer.feed(ByteView(reply).subspan(begun)), kReplyPdu) << begun;
        EXPECT_FALSE(framer.has_pending());
    }
    ReplyFramer framer(5, kRequest);
    Bytes heard = reply;
    heard.push_back(0);
    ASSERT_EQ(framer.feed(heard), kReplyPdu);
    EXPECT_FALSE(framer.has_pending()) << "noise";
}

TEST_F(RtuFramer, SoIsWhatBeginsLikeTheSameConfirmationOfAWrite) {
    for (const Bytes& request : {"06 00 01 00 03"_hex, "10 00 01 00 01 02 00 03"_hex}) {
        const Bytes confirmation(request.begin(), request.begin() + 5);
        const Bytes reply = encode_adu(5, confirmation);
        for (std::size_t begun = 1; begun < reply.size(); ++begun) {
            ReplyFramer framer(5, request);
            Bytes heard = reply;
            heard.insert(heard.end(), reply.begin(), reply.begin() + static_cast<int>(begun));
            ASSERT_EQ(framer.feed(heard), confirmation);
            EXPECT_EQ(framer.feed(ByteView(reply).subspan(begun)), confirmation) << begun;
        }
        ReplyFramer framer(5, request);
        Bytes heard = reply;
        heard.insert(heard.end(), {5, request[0], 0, 2});  // of another place
        ASSERT_EQ(framer.feed(heard), confirmation);
        EXPECT_FALSE(framer.has_pending());
    }
}

/// P4: a reply that has begun is not damaged by who speaks in its pause, and a request heard there
/// keeps its reply.
class AnyLengthFramer : public ::testing::Test {
  protected:
    const Bytes clock = "04 00 01 00 01"_hex;
    const Bytes told = "04 0C 07 E5 0A 1F 00 0F 1E 00 00 80 00 00"_hex;
    ReplyFramer framer{1, clock, {}, ReplyFramer::Ends::by_length, ByteCount::any};
};

TEST_F(AnyLengthFramer, TheByteCountOfTheReplyDecides) {
    const Bytes reply = encode_adu(1, told);
    EXPECT_FALSE(ReplyFramer(1, clock).feed(reply));
    for (std::size_t at = 0; at + 1 < reply.size(); ++at) {
        EXPECT_FALSE(framer.feed(ByteView(reply).subspan(at, 1)));
        EXPECT_EQ(framer.missing_as_asked(), framer.missing());
    }
    EXPECT_EQ(framer.missing(), 1u);
    EXPECT_TRUE(framer.knows_length());
    EXPECT_EQ(framer.feed(ByteView(reply).last(1)), told);
    EXPECT_EQ(framer.feed(encode_adu(1, "84 02"_hex)), "84 02"_hex);
}

TEST_F(AnyLengthFramer, OurOwnFrameAndOtherStationsAreNoReply) {
    EXPECT_FALSE(framer.feed(encode_adu(1, clock)));
    EXPECT_FALSE(framer.feed(encode_adu(2, told)));
    EXPECT_FALSE(framer.feed(encode_adu(1, "03 02 00 01"_hex)));
    EXPECT_EQ(framer.feed(encode_adu(1, told)), told);
}

TEST_F(AnyLengthFramer, OfADamagedReplyNothingMoreIsKnownThanThatItWasThere) {
    Bytes reply = encode_adu(1, told);
    reply.back() ^= 1;
    EXPECT_FALSE(framer.feed(reply));
    EXPECT_FALSE(framer.on_silence());
    EXPECT_TRUE(framer.was_damaged());
    EXPECT_TRUE(framer.was_damaged_whole());
    EXPECT_FALSE(framer.had_own_header());
    EXPECT_FALSE(framer.ends_beheaded(ByteView(reply).subspan(1)));
}

TEST_F(AnyLengthFramer, TheEndOfALineOfAsciiDecidesTheSame) {
    ReplyFramer line(1, clock, {}, ReplyFramer::Ends::told, ByteCount::any);
    EXPECT_FALSE(line.feed(encode_adu(1, told)));
    EXPECT_EQ(line.on_end(true), told);
    EXPECT_FALSE(line.feed(encode_adu(1, "04 04 00 00"_hex)));
    EXPECT_FALSE(line.on_end(true)) << "fewer bytes than it says";
}

TEST(Framer, AFrameBehindTheBeginningOfAnotherIsFound) {
    Bytes heard{5, 3};
    const Bytes other = encode_adu(9, kReplyPdu);
    heard.insert(heard.end(), other.begin(), other.end());
    heard.push_back(0);
    const auto parts = classify_heard(heard, 5);
    ASSERT_EQ(parts.size(), 3u);
    EXPECT_EQ(parts[0].kind, Unused::Kind::damaged);
    EXPECT_EQ(parts[1].kind, Unused::Kind::foreign);
    EXPECT_EQ(parts[2].kind, Unused::Kind::damaged);

    ReplyFramer framer(5, kRequest);
    EXPECT_EQ(framer.feed(heard), std::nullopt);
    EXPECT_EQ(framer.on_silence(), std::nullopt);
    EXPECT_FALSE(framer.was_damaged_whole());

    const Bytes asked = encode_adu(9, kRequest);
    Bytes both{5, 3};
    both.insert(both.end(), asked.begin(), asked.end());
    both.insert(both.end(), other.begin(), other.end());
    const auto kept = classify_heard(both, 5);
    ASSERT_EQ(kept.size(), 2u);
    EXPECT_EQ(kept[1].bytes.size(), asked.size() + other.size());
}

/// What stands in front of its first byte is none of it.
TEST(Framer, AReplyBehindARequestIsDamagedAsAWholeOnlyIfItWasAllThere) {
    const Bytes reply = encode_adu(5, kReplyPdu);
    for (const std::size_t size : {std::size_t{2}, reply.size()}) {
        ReplyFramer framer(5, kRequest);
        Bytes heard = encode_adu(9, kRequest);
        heard.insert(heard.end(), reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(size));
        heard.back() ^= size == reply.size() ? 1 : 0;
        framer.feed(heard);
        framer.on_silence();
        EXPECT_TRUE(framer.was_damaged());
        EXPECT_EQ(framer.was_damaged_whole(), size == reply.size());
    }
}

TEST_F(FramerOfBothOrders, TheWrongOrderIsDamage) {
    const auto parts = classify_heard(encode_adu(5, kReplyPdu), 6, orders);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].kind, Unused::Kind::damaged);
    EXPECT_EQ(classify_heard(old_reply, 6, orders)[0].kind, Unused::Kind::foreign);
}

/// Function 07 is a request of one byte: it has no address with which a reply could be compared.
TEST(DamagedReply, OfARequestWithoutAnAddressIsNotOurOwnFrame) {
    ReplyFramer framer(0x11, "07"_hex);
    EXPECT_EQ(framer.feed("11 07 00 12 34"_hex), std::nullopt);
    framer.drop_pending();
    EXPECT_TRUE(framer.was_damaged());
    EXPECT_FALSE(ReplyFramer(0x11, "07"_hex).was_damaged());
}

}  // namespace
}  // namespace panelgate::modbus::rtu_framer_test
