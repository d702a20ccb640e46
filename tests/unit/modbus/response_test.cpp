#include "panelgate/modbus/response.hpp"

#include <gtest/gtest.h>

#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::modbus::response_test {
namespace {

using Random = std::mt19937;
using Texts = std::vector<const char*>;

Bytes joined(Bytes front, const Bytes& back) {
    front.insert(front.end(), back.begin(), back.end());
    return front;
}

Bytes bytes_of(const char* hex) { return from_hex(hex).value(); }

/// A request, replies that answer it and replies that do not.
struct Judged {
    const char* request;
    Texts good;
    Texts bad;
};

const Judged kJudged[] = {
    // An exception of the same function in two bytes; vendors' codes pass.
    {"03 00 6B 00 03", {"83 02", "83 41"}, {"", "83", "83 02 00", "84 02"}},
    {"", {}, {"03 02 00 01", ""}},
    // As many bytes as were asked for; pad bits are not judged.
    {"01 00 13 00 13", {"01 03 CD 6B 05", "01 03 CD 6B FF"}, {"01 02 CD 6B"}},
    // ... and count and size may not differ.
    {"03 00 6B 00 01", {"03 02 02 2B"}, {"04 02 02 2B", "03 04 02 2B 00 00", "03 03 02 2B"}},
    // 258 bytes are not 2.
    {"03 00 6B 00 81", {}, {"03 02 02 2B"}},
    // The echo of single writes.
    {"05 00 AC FF 00", {"05 00 AC FF 00"}, {"05 00 AC 00 00"}},
    {"06 00 01 00 03", {}, {"06 00 02 00 03", "06 00 01 00"}},
    {"16 00 04 00 F2 00 25", {}, {"16 00 04 00 F2 00 24"}},
    {"15 09 06 00 04 00 07 00 01 06 AF", {}, {"15 09 06 00 04 00 07 00 01 06 AE"}},
    // Address and quantity of multiple writes: the echo of the request is not the reply.
    {"10 00 01 00 02 04 00 0A 01 02",
     {"10 00 01 00 02"},
     {"10 00 01 00 03", "10 00 02 00 02", "10 00 01 00 02 04 00 0A 01 02"}},
    // The sub-function of diagnostics; 04 is never answered.
    {"08 00 00 A5 37", {"08 00 00 A5 37"}, {"08 00 00 A5 38"}},
    {"08 00 0B 00 00", {"08 00 0B 12 34"}, {"08 00 0C 12 34", "08 00 0B"}},
    {"08 00 04 00 00", {}, {"08 00 04 00 00"}},
    // The fixed sizes of status and counter.
    {"07", {"07 6D"}, {"07 6D 00"}},
    {"0B", {"0B FF FF 01 08"}, {"0B FF FF 01"}},
    // A byte count that is true.
    {"0C", {"0C 08 00 00 01 08 01 21 20 00"}, {"0C 08 00 00 01 08 01 21 20"}},
    {"11", {"11 02 B4 FF"}, {"11 03 B4 FF", "11"}},
    {"18 04 DE",
     {"18 00 06 00 02 01 B8 12 84"},
     {"18 00 06 00 03 01 B8 12 84", "18 00 08 00 02 01 B8 12 84"}},
    // Every file group as it was asked for: order, type, number.
    {"14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 01",
     {"14 0A 05 06 0D FE 00 20 03 06 33 CD"},
     {"14 0A 03 06 33 CD 05 06 0D FE 00 20", "14 0A 05 07 0D FE 00 20 03 06 33 CD",
      "14 06 05 06 0D FE 00 20"}},
    // The MEI type and the code; the objects may be miscounted.
    {"2B 0E 01 00",
     {"2B 0E 01 01 00 00 01 00 01 41", "2B 0E 01 01 00 00 09 00 01 41"},
     {"2B 0E 02 01 00 00 01 00 01 41", "2B 0D 01 01 00 00 01 00 01 41", "2B 0E 01 01 00 00"}},
    {"2B 0E 04 81", {"2B 0E 04 83 00 00 01 81 01 41"}, {"2B 0E 04 83 00 00 01 00 01 41"}},
    {"2B 0D 01", {"2B 0D"}, {}},
    // Only the function of vendors' own.
    {"41 00 01", {"41", "41 C0 C1 C2"}, {"42 C0 C1 C2"}},
};

TEST(Answers, WhatRepeatsTheRequestAndHasTheSizeOfTheReply) {
    for (const Judged& row : kJudged) {
        for (const char* reply : row.good)
            EXPECT_TRUE(answers(bytes_of(row.request), bytes_of(reply)))
                << row.request << " / " << reply;
        for (const char* reply : row.bad)
            EXPECT_FALSE(answers(bytes_of(row.request), bytes_of(reply)))
                << row.request << " / " << reply;
    }
}

TEST(Answers, WithAnyByteCountAReadIsAnsweredByAnyNumberOfBytesThatIsTrue) {
    const Bytes clock = "04 00 01 00 01"_hex;  // one register of 12 bytes
    const Bytes longest = joined("03 FB"_hex, Bytes(251, 7));
    EXPECT_FALSE(answers(clock, "04 0C 07 E5 0A 1F 00 0F 1E 00 00 80 00 00"_hex));
    for (const Bytes& reply : {"04 0C 07 E5 0A 1F 00 0F 1E 00 00 80 00 00"_hex,
                               "04 04 00 00 12 34"_hex, "04 02 12 34"_hex, "84 02"_hex})
        EXPECT_TRUE(answers(clock, reply, ByteCount::any)) << to_hex(reply);
    for (const Bytes& reply : {"04 0C 07 E5"_hex, "04 00"_hex, "04"_hex, "03 04 00 00 12 34"_hex})
        EXPECT_FALSE(answers(clock, reply, ByteCount::any)) << to_hex(reply);
    EXPECT_TRUE(answers("03 00 00 00 01"_hex, longest, ByteCount::any));
    EXPECT_FALSE(answers("03 00 00 00 01"_hex, joined("03 FC"_hex, Bytes(252, 7)), ByteCount::any))
        << "more than Modbus/TCP carries";
    for (const auto& [request, reply] :
         {std::pair("06 00 01 00 03"_hex, "06 00 02 00 03"_hex),
          std::pair("17 00 00 00 01 00 00 00 01 02 00 00"_hex, "17 04 00 00 00 00"_hex)})
        EXPECT_FALSE(answers(request, reply, ByteCount::any)) << to_hex(request);
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

Bytes any_write_request(Random& random) {
    const std::uint16_t address = number(random, 0, 65535);
    switch (number(random, 0, 3)) {
        case 0:
            return encode_write_coil(address, number(random, 0, 1) == 1);
        case 1:
            return encode_write_register(address, number(random, 0, 65535));
        case 2: {
            std::vector<bool> values(number(random, 1, 1968));
            for (auto&& value : values) value = number(random, 0, 1) == 1;
            return encode_write_coils(address, values);
        }
        default: {
            std::vector<std::uint16_t> values(number(random, 1, 123));
            for (std::uint16_t& value : values) value = number(random, 0, 65535);
            return encode_write_registers(address, values);
        }
    }
}

Bytes any_echoed_request(Random& random) {
    Writer request;
    if (number(random, 0, 1) == 0) return request.u8(0x16).raw(noise(random, 6)).take();
    const std::size_t words = number(random, 1, 100);
    return request.u8(0x08).u16(0).raw(noise(random, 2 * words)).take();
}

Exchange any_exchange(Random& random) {
    const auto kind = number(random, 0, 2);
    if (kind == 0) return any_read(random);
    const Bytes request = kind == 1 ? any_write_request(random) : any_echoed_request(random);
    if (kind == 1) return {request, normal_write_reply(request), 5};
    return {request, request, request.size()};
}

TEST(AnswersProperty, EveryRequestIsAnsweredByItsReplyOrAnException) {
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

TEST(AnswersProperty, NoByteThatMustComeBackMayDifferAndNoneBeTooFewOrMany) {
    Random random(4);
    for (int round = 0; round < 3000; ++round) {
        const Exchange e = any_exchange(random);
        for (std::size_t i = 0; i < e.echoed; ++i) {
            Bytes wrong = e.reply;
            wrong[i] = static_cast<std::uint8_t>(wrong[i] ^ number(random, 1, 255));
            ASSERT_FALSE(answers(e.request, wrong)) << to_hex(e.request) << " / " << to_hex(wrong);
        }
        Bytes longer = e.reply;
        longer.push_back(0);
        ASSERT_FALSE(answers(e.request, longer)) << to_hex(e.request);
        ASSERT_FALSE(answers(e.request, ByteView(e.reply).first(e.reply.size() - 1)))
            << to_hex(e.request);
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

Bytes sent_for(const Bytes& asked) {
    const auto other = translated(test::request_of(asked));
    return other ? other->pdu() : Bytes{};
}

TEST(Translation, AWriteIsOneOfSeveralAndInputsAreReadAsWhatShowsTheSame) {
    EXPECT_EQ(sent_for("05 00 AC FF 00"_hex), "0F 00 AC 00 01 01 01"_hex);
    EXPECT_EQ(sent_for("05 FF FF 00 00"_hex), "0F FF FF 00 01 01 00"_hex);
    EXPECT_EQ(sent_for("06 00 64 12 34"_hex), "10 00 64 00 01 02 12 34"_hex);
    EXPECT_EQ(sent_for("02 01 20 00 05"_hex), "01 01 20 00 05"_hex);
    EXPECT_EQ(sent_for("04 00 64 00 05"_hex), "03 00 64 00 05"_hex);
}

TEST(Translation, NothingElseIsTranslatedNorAValueThatIsNoCoils) {
    for (const Bytes& asked :
         {"05 00 AC 00 01"_hex, "05 00 AC FF 01"_hex, "05 00 AC 55 00"_hex, "01 00 00 00 01"_hex,
          "03 00 00 00 01"_hex, "07"_hex, "0F 00 00 00 01 01 01"_hex, "10 00 00 00 01 02 00 01"_hex,
          "16 00 04 00 F2 00 25"_hex, "17 00 00 00 01 00 00 00 01 02 00 01"_hex, "41 01"_hex})
        EXPECT_EQ(sent_for(asked), Bytes{}) << to_hex(asked);
}

/// A write is confirmed as it was asked; a read gives its values, and an exception its code, under
/// the function asked.
TEST(Translation, WhatComesBackAnswersWhatWasAsked) {
    for (const auto& [asked, reply, back] :
         {std::tuple("05 00 AC FF 00"_hex, "0F 00 AC 00 01"_hex, "05 00 AC FF 00"_hex),
          std::tuple("06 00 64 12 34"_hex, "10 00 64 00 01"_hex, "06 00 64 12 34"_hex),
          std::tuple("02 01 20 00 05"_hex, "01 01 19"_hex, "02 01 19"_hex),
          std::tuple("04 00 64 00 01"_hex, "03 02 00 0A"_hex, "04 02 00 0A"_hex),
          std::tuple("05 00 AC FF 00"_hex, "8F 02"_hex, "85 02"_hex),
          std::tuple("06 00 64 12 34"_hex, "90 03"_hex, "86 03"_hex),
          std::tuple("02 01 20 00 05"_hex, "81 01"_hex, "82 01"_hex),
          std::tuple("04 00 64 00 01"_hex, "83 99"_hex, "84 99"_hex)}) {
        EXPECT_TRUE(answers(sent_for(asked), reply)) << to_hex(reply);
        EXPECT_EQ(translated_back(asked, reply), back) << to_hex(reply);
        EXPECT_TRUE(answers(asked, back)) << to_hex(reply);
    }
}

}  // namespace
}  // namespace panelgate::modbus::response_test
