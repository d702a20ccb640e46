#include "panelgate/modbus/response.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/hex.hpp"

namespace panelgate::modbus::response_test {
namespace {

using Random = std::mt19937;

TEST(Answers, AcceptsAnExceptionOfTheSameFunctionInTwoBytes) {
    const Bytes request = "03 00 6B 00 03"_hex;
    EXPECT_TRUE(answers(request, "83 02"_hex));
    EXPECT_TRUE(answers(request, "83 41"_hex)) << "vendors' codes pass";
    EXPECT_FALSE(answers(request, "83"_hex));
    EXPECT_FALSE(answers(request, "83 02 00"_hex));
    EXPECT_FALSE(answers(request, "84 02"_hex));
}

TEST(Answers, IsNotFooledByNothing) {
    EXPECT_FALSE(answers("03 00 6B 00 03"_hex, {}));
    EXPECT_FALSE(answers({}, "03 02 00 01"_hex));
    EXPECT_FALSE(answers({}, {}));
}

TEST(Answers, WantsAsManyBytesAsWereAskedFor) {
    EXPECT_TRUE(answers("01 00 13 00 13"_hex, "01 03 CD 6B 05"_hex));
    EXPECT_FALSE(answers("01 00 13 00 13"_hex, "01 02 CD 6B"_hex));
    EXPECT_TRUE(answers("01 00 13 00 13"_hex, "01 03 CD 6B FF"_hex)) << "pad bits are not judged";
    EXPECT_TRUE(answers("03 00 6B 00 01"_hex, "03 02 02 2B"_hex));
    EXPECT_FALSE(answers("03 00 6B 00 01"_hex, "04 02 02 2B"_hex));
    EXPECT_FALSE(answers("03 00 6B 00 01"_hex, "03 04 02 2B 00 00"_hex));
    EXPECT_FALSE(answers("03 00 6B 00 01"_hex, "03 03 02 2B"_hex)) << "count and size differ";
    EXPECT_FALSE(answers("03 00 6B 00 81"_hex, "03 02 02 2B"_hex)) << "258 bytes are not 2";
}

TEST(Answers, WantsTheEchoOfSingleWrites) {
    EXPECT_TRUE(answers("05 00 AC FF 00"_hex, "05 00 AC FF 00"_hex));
    EXPECT_FALSE(answers("05 00 AC FF 00"_hex, "05 00 AC 00 00"_hex));
    EXPECT_FALSE(answers("06 00 01 00 03"_hex, "06 00 02 00 03"_hex));
    EXPECT_FALSE(answers("06 00 01 00 03"_hex, "06 00 01 00"_hex));
    EXPECT_FALSE(answers("16 00 04 00 F2 00 25"_hex, "16 00 04 00 F2 00 24"_hex));
    EXPECT_FALSE(
        answers("15 09 06 00 04 00 07 00 01 06 AF"_hex, "15 09 06 00 04 00 07 00 01 06 AE"_hex));
}

TEST(Answers, WantsAddressAndQuantityOfMultipleWrites) {
    const Bytes request = "10 00 01 00 02 04 00 0A 01 02"_hex;
    EXPECT_TRUE(answers(request, "10 00 01 00 02"_hex));
    EXPECT_FALSE(answers(request, "10 00 01 00 03"_hex));
    EXPECT_FALSE(answers(request, "10 00 02 00 02"_hex));
    EXPECT_FALSE(answers(request, request)) << "the echo of the request is not the reply";
}

TEST(Answers, WantsTheSubFunctionOfDiagnosticsBack) {
    EXPECT_TRUE(answers("08 00 00 A5 37"_hex, "08 00 00 A5 37"_hex));
    EXPECT_FALSE(answers("08 00 00 A5 37"_hex, "08 00 00 A5 38"_hex));
    EXPECT_TRUE(answers("08 00 0B 00 00"_hex, "08 00 0B 12 34"_hex));
    EXPECT_FALSE(answers("08 00 0B 00 00"_hex, "08 00 0C 12 34"_hex));
    EXPECT_FALSE(answers("08 00 0B 00 00"_hex, "08 00 0B"_hex));
    EXPECT_FALSE(answers("08 00 04 00 00"_hex, "08 00 04 00 00"_hex)) << "is never answered";
}

TEST(Answers, WantsTheFixedSizesOfStatusAndCounter) {
    EXPECT_TRUE(answers("07"_hex, "07 6D"_hex));
    EXPECT_FALSE(answers("07"_hex, "07 6D 00"_hex));
    EXPECT_TRUE(answers("0B"_hex, "0B FF FF 01 08"_hex));
    EXPECT_FALSE(answers("0B"_hex, "0B FF FF 01"_hex));
}

TEST(Answers, WantsAByteCountThatIsTrue) {
    EXPECT_TRUE(answers("0C"_hex, "0C 08 00 00 01 08 01 21 20 00"_hex));
    EXPECT_FALSE(answers("0C"_hex, "0C 08 00 00 01 08 01 21 20"_hex));
    EXPECT_TRUE(answers("11"_hex, "11 02 B4 FF"_hex));
    EXPECT_FALSE(answers("11"_hex, "11 03 B4 FF"_hex));
    EXPECT_FALSE(answers("11"_hex, "11"_hex));
    EXPECT_TRUE(answers("18 04 DE"_hex, "18 00 06 00 02 01 B8 12 84"_hex));
    EXPECT_FALSE(answers("18 04 DE"_hex, "18 00 06 00 03 01 B8 12 84"_hex));
    EXPECT_FALSE(answers("18 04 DE"_hex, "18 00 08 00 02 01 B8 12 84"_hex));
}

TEST(Answers, WantsEveryFileGroupAsItWasAskedFor) {
    const Bytes request = "14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 01"_hex;
    EXPECT_TRUE(answers(request, "14 0A 05 06 0D FE 00 20 03 06 33 CD"_hex));
    EXPECT_FALSE(answers(request, "14 0A 03 06 33 CD 05 06 0D FE 00 20"_hex)) << "order";
    EXPECT_FALSE(answers(request, "14 0A 05 07 0D FE 00 20 03 06 33 CD"_hex)) << "type";
    EXPECT_FALSE(answers(request, "14 06 05 06 0D FE 00 20"_hex)) << "one group missing";
}

TEST(Answers, WantsTheMeiTypeAndTheCodeBack) {
    EXPECT_TRUE(answers("2B 0E 01 00"_hex, "2B 0E 01 01 00 00 01 00 01 41"_hex));
    EXPECT_TRUE(answers("2B 0E 01 00"_hex, "2B 0E 01 01 00 00 09 00 01 41"_hex)) << "miscounted";
    EXPECT_FALSE(answers("2B 0E 01 00"_hex, "2B 0E 02 01 00 00 01 00 01 41"_hex));
    EXPECT_FALSE(answers("2B 0E 01 00"_hex, "2B 0D 01 01 00 00 01 00 01 41"_hex));
    EXPECT_FALSE(answers("2B 0E 01 00"_hex, "2B 0E 01 01 00 00"_hex));
    EXPECT_TRUE(answers("2B 0D 01"_hex, "2B 0D"_hex));
}

TEST(Answers, KnowsOnlyTheFunctionOfVendorsOwn) {
    EXPECT_TRUE(answers("41 00 01"_hex, "41"_hex));
    EXPECT_TRUE(answers("41 00 01"_hex, "41 C0 C1 C2"_hex));
    EXPECT_FALSE(answers("41 00 01"_hex, "42 C0 C1 C2"_hex));
}

TEST(Response, GivesTheNormalReplyOfABroadcast) {
    EXPECT_EQ(normal_write_reply("05 00 10 00 00"_hex), "05 00 10 00 00"_hex);
    EXPECT_EQ(normal_write_reply("06 00 01 00 03"_hex), "06 00 01 00 03"_hex);
    EXPECT_EQ(normal_write_reply("0F 00 10 00 05 01 1A"_hex), "0F 00 10 00 05"_hex);
    EXPECT_EQ(normal_write_reply("10 00 64 00 02 04 00 0A 01 02"_hex), "10 00 64 00 02"_hex);
}

TEST(Response, TakesRegistersAndBitsOut) {
    EXPECT_EQ(registers_of("03 06 02 2B 00 00 00 64"_hex),
              (std::vector<std::uint16_t>{0x022B, 0, 0x64}));
    EXPECT_EQ(bits_of("01 01 19"_hex, 5), (std::vector<bool>{true, false, false, true, true}));
    EXPECT_EQ(bits_of("01 02 00 01"_hex, 9)[8], true);
}

std::uint16_t number(Random& random, unsigned min, unsigned max) {
    return static_cast<std::uint16_t>(std::uniform_int_distribution<unsigned>(min, max)(random));
}

Bytes noise(Random& random, std::size_t size) {
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    return bytes;
}

struct Exchange {
    Bytes request;
    Bytes reply;
    std::size_t echoed = 0;  ///< bytes at the front of the reply that must come back
};

Exchange any_read(Random& random) {
    const auto table = static_cast<Table>(number(random, 0, 3));
    const std::uint16_t count = number(random, 1, is_bit_table(table) ? 2008 : 125);
    const std::size_t size = is_bit_table(table) ? (count + 7u) / 8 : 2u * count;
    Writer reply;
    reply.u8(read_function(table)).u8(static_cast<unsigned>(size)).raw(noise(random, size));
    return {encode_read(table, number(random, 0, 65535), count), reply.take(), 2};
}

Exchange any_write(Random& random) {
    const std::uint16_t address = number(random, 0, 65535);
    Bytes request;
    switch (number(random, 0, 3)) {
        case 0:
            request = encode_write_coil(address, number(random, 0, 1) == 1);
            break;
        case 1:
            request = encode_write_register(address, number(random, 0, 65535));
            break;
        case 2: {
            std::vector<bool> values(number(random, 1, 1968));
            for (auto&& value : values) value = number(random, 0, 1) == 1;
            request = encode_write_coils(address, values);
            break;
        }
        default: {
            std::vector<std::uint16_t> values(number(random, 1, 123));
            for (std::uint16_t& value : values) value = number(random, 0, 65535);
            request = encode_write_registers(address, values);
        }
    }
    Bytes reply = normal_write_reply(request);
    return {std::move(request), std::move(reply), 5};
}

Exchange any_echo(Random& random) {
    Writer request;
    if (number(random, 0, 1) == 0) {
        request.u8(0x16).raw(noise(random, 6));
    } else {
        const std::size_t words = number(random, 1, 100);
        request.u8(0x08).u16(0).raw(noise(random, 2 * words));
    }
    const Bytes pdu = request.take();
    return {pdu, pdu, pdu.size()};
}

Exchange any_exchange(Random& random) {
    switch (number(random, 0, 2)) {
        case 0:
            return any_read(random);
        case 1:
            return any_write(random);
        default:
            return any_echo(random);
    }
}

TEST(AnswersProperty, EveryRequestIsAnsweredByItsReply) {
    Random random(3);
    for (int round = 0; round < 5000; ++round) {
        const Exchange e = any_exchange(random);
        ASSERT_TRUE(check_request(e.request)) << to_hex(e.request);
        ASSERT_TRUE(answers(e.request, e.reply)) << to_hex(e.request) << " / " << to_hex(e.reply);
        ASSERT_EQ(reply_length_from_request(e.request), e.reply.size() + 3) << to_hex(e.request);
        const Bytes exception = {static_cast<std::uint8_t>(e.request[0] | 0x80),
                                 static_cast<std::uint8_t>(random())};
        ASSERT_TRUE(answers(e.request, exception)) << to_hex(e.request);
    }
}

TEST(AnswersProperty, NoByteThatMustComeBackMayDiffer) {
    Random random(4);
    for (int round = 0; round < 3000; ++round) {
        const Exchange e = any_exchange(random);
        for (std::size_t i = 0; i < e.echoed; ++i) {
            Bytes wrong = e.reply;
            wrong[i] = static_cast<std::uint8_t>(wrong[i] ^ number(random, 1, 255));
            ASSERT_FALSE(answers(e.request, wrong)) << to_hex(e.request) << " / " << to_hex(wrong);
        }
    }
}

TEST(AnswersProperty, NoReplyMayBeShorterOrLonger) {
    Random random(5);
    for (int round = 0; round < 3000; ++round) {
        const Exchange e = any_exchange(random);
        Bytes longer = e.reply;
        longer.push_back(0);
        const Bytes shorter(e.reply.begin(), e.reply.end() - 1);
        ASSERT_FALSE(answers(e.request, longer)) << to_hex(e.request);
        ASSERT_FALSE(answers(e.request, shorter)) << to_hex(e.request);
    }
}

TEST(AnswersProperty, AnyBytesAreJudgedWithoutHarm) {
    Random random(6);
    for (int round = 0; round < 20000; ++round) {
        Bytes request = noise(random, number(random, 1, 20));
        Bytes reply = noise(random, number(random, 0, 20));
        request[0] = static_cast<std::uint8_t>(number(random, 1, 0x2B));
        if (!reply.empty()) reply[0] = request[0];
        const bool matched = answers(request, reply);
        ASSERT_TRUE(!matched || reply[0] == request[0]);
        access_of(request);
        registers_of(reply);
        bits_of(reply, 100);
    }
}

}  // namespace
}  // namespace panelgate::modbus::response_test
