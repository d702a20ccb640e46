#include "panelgate/modbus/request.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>
#include <utility>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::modbus::request_test {
namespace {

using Pdus = std::initializer_list<Bytes>;

void expect_pass(Pdus pdus, QuantityCheck check = QuantityCheck::fit) {
    for (const Bytes& pdu : pdus) EXPECT_TRUE(check_request(pdu, check)) << to_hex(pdu);
}
void expect_fault(Fault fault, Pdus pdus, QuantityCheck check = QuantityCheck::fit) {
    for (const Bytes& pdu : pdus) {
        const Result<void> verdict = check_request(pdu, check);
        EXPECT_TRUE(!verdict && verdict.error() == fault) << to_hex(pdu);
    }
}
void expect_malformed(Pdus pdus, QuantityCheck check = QuantityCheck::fit) {
    expect_fault(Fault::malformed, pdus, check);
}

Bytes read_of(Table table, std::uint16_t count) { return encode_read(table, 0, count); }
Bytes write_registers(std::size_t count) {
    return encode_write_registers(0, std::vector<std::uint16_t>(count, 7));
}
Bytes write_coils(std::size_t count) {
    return encode_write_coils(0, std::vector<bool>(count, true));
}

/// 17h: reads `read` registers and writes `written`.
Bytes read_write(unsigned read, unsigned written) {
    Writer out;
    out.u8(0x17).u16(0).u16(read).u16(0).u16(written).u8(2 * written).raw(Bytes(2 * written, 1));
    return out.take();
}

/// 14h with one sub-request of n registers.
Bytes read_file(unsigned n) { return Writer().u8(0x14).u8(7).u8(6).u16(1).u16(0).u16(n).take(); }

TEST(CheckRequest, DeniesFunctionZeroAndTheReplyRangeWhateverFollows) {
    expect_malformed({""_hex});
    expect_fault(Fault::denied,
                 {"00"_hex, "80"_hex, "83 00 00 00 01"_hex, "FF"_hex, Bytes(300, 0)});
}

/// Functions whose requests have one length (PDU-07): a byte less or more contradicts them.
TEST(CheckRequest, WantsTheLengthOfTheFunction) {
    for (const Bytes& good :
         {"01 00 13 00 13"_hex, "02 00 C4 00 16"_hex, "03 00 6B 00 03"_hex, "04 00 08 00 01"_hex,
          "05 00 AC FF 00"_hex, "06 00 01 00 03"_hex, "07"_hex, "0B"_hex, "0C"_hex, "11"_hex,
          "18 04 DE"_hex, "2B 0E 01 00"_hex, write_coils(10), write_registers(2),
          "16 00 04 00 F2 00 25"_hex, read_write(6, 3), read_file(2),
          "15 0B 06 00 04 00 07 00 02 06 AF 04 BE"_hex}) {
        Bytes longer = good;
        longer.push_back(0);
        expect_pass({good});
        expect_malformed({longer, Bytes(good.begin(), good.end() - 1)});
    }
}

TEST(CheckRequest, WantsTheByteCountThatTheQuantityNeeds) {
    expect_malformed({"10 00 01 00 01 04 00 01"_hex, "10 00 01 00 01 04 00 01 00 02"_hex,
                      "0F 00 01 00 09 01 FF"_hex, "17 00 00 00 01 00 00 00 02 02 00 01"_hex,
                      // 258 bytes are not the 2 that they look.
                      "10 00 01 00 81 02 00 01"_hex});
    expect_pass({"0F 00 01 00 08 01 FF"_hex});
}

TEST(CheckRequest, WantsWholeSubRequests) {
    expect_pass({"14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 02"_hex});
    expect_malformed({"14 08 06 00 04 00 01 00 02 06"_hex,
                      "15 0D 06 00 04 00 07 00 02 06 AF 04 BE 10 0D"_hex,
                      "15 0D 06 00 04 00 07 00 04 06 AF 04 BE 10 0D"_hex});
}

TEST(CheckRequest, WantsAtLeastOneDataWordInDiagnostics) {
    expect_pass({"08 00 00 A5 37"_hex, "08 00 00 A5 37 01 02"_hex});
    expect_malformed({"08"_hex, "08 00 00"_hex, "08 00 00 A5"_hex, "08 00 00 A5 37 01"_hex});
}

TEST(CheckRequest, HasNoRuleForOtherMeiTypesAndUnknownFunctions) {
    expect_pass({"2B 0D"_hex, "2B 0D 01 02 03"_hex, "41"_hex, "5A 01 02 03"_hex, Bytes(253, 0x41)});
    expect_malformed({"2B"_hex, Bytes(254, 0x41)});
}

TEST(CheckRequest, RefusesWhatNoReplyCouldCarryAndPdusOver253Bytes) {
    expect_pass({read_of(Table::holding_registers, 125), read_of(Table::coils, 2008),
                 read_write(125, 121), read_file(124),       // 2 + 248 bytes
                 write_registers(123), write_coils(1976)});  // 247 bytes of data
    expect_malformed({read_of(Table::holding_registers, 126), read_of(Table::input_registers, 126),
                      read_of(Table::coils, 2009), read_of(Table::discrete_inputs, 0xFFFF),
                      read_write(126, 1), read_file(125), write_registers(124), write_coils(1977),
                      read_write(1, 122)});
}

TEST(CheckRequest, LetsOneByteOfByteCountPassWhenWide) {
    EXPECT_EQ(write_registers(127).size(), 260u);
    EXPECT_EQ(write_coils(2040).size(), kMaxLongRequestPdu);
    expect_pass({read_of(Table::holding_registers, 127), read_of(Table::coils, 2040),
                 write_registers(127), write_coils(2040)},
                QuantityCheck::wide);
    expect_malformed({read_of(Table::holding_registers, 128), read_of(Table::coils, 2041),
                      Bytes(262, 0x41), "03 00 00 00"_hex},
                     QuantityCheck::wide);
}

TEST(CheckRequest, LeavesTheRestToThePanel) {
    expect_pass({"03 00 00 00 00"_hex,                // quantity 0
                 "10 00 00 00 00 00"_hex,             // quantity 0
                 "03 FF FF 00 02"_hex,                // beyond the last address
                 "05 00 00 12 34"_hex,                // neither on nor off
                 "0F 00 00 00 01 01 FF"_hex,          // pad bits
                 "14 07 09 00 01 00 00 00 01"_hex});  // reference type
}

TEST(ReplyLengthFromRequest, CountsAddressAndCrcAndDoesNotGuess) {
    for (const auto& [pdu, length] :
         {std::pair("01 00 00 00 08"_hex, 6u), std::pair("01 00 00 00 09"_hex, 7u),
          std::pair("03 00 00 FF FF"_hex, 5u + 2 * 65535),
          std::pair("08 00 00 01 02 03 04"_hex, 10u), std::pair("08 00 0B 00 00"_hex, 8u),
          std::pair("08 00 04 00 00"_hex, 0u), std::pair(read_write(6, 3), 17u)})
        EXPECT_EQ(reply_length_from_request(pdu), length) << to_hex(pdu);
    for (const Bytes& pdu : {Bytes(), "0C"_hex, "11"_hex, "18 00 00"_hex, "2B 0E 01 00"_hex,
                             "2B 0D 00"_hex, "41 00"_hex})
        EXPECT_FALSE(reply_length_from_request(pdu)) << to_hex(pdu);
}

TEST(Request, IsMadeOfWhatMayBeTransmittedOnly) {
    const Bytes most = "03 00 00 00 7E"_hex;  // 126 registers
    EXPECT_EQ(Request::make({}, QuantityCheck::fit).error(), Fault::malformed);
    EXPECT_EQ(Request::make("03 00 6B"_hex, QuantityCheck::wide).error(), Fault::malformed);
    EXPECT_EQ(Request::make("83 00"_hex, QuantityCheck::wide).error(), Fault::denied);
    EXPECT_EQ(Request::make(most, QuantityCheck::fit).error(), Fault::malformed);
    EXPECT_EQ(Request::make(most, QuantityCheck::wide)->pdu(), most);
}

TEST(Request, KnowsWhatItIs) {
    for (const Bytes& pdu :
         {"03 00 6B 00 03"_hex, "01 00 00 00 00"_hex, "02 FF FF 00 02"_hex, "06 00 01 00 03"_hex,
          write_coils(10), read_write(2, 1), read_file(3), "07"_hex, "08 00 04 00 00"_hex,
          "18 04 DE"_hex, "2B 0E 01 00"_hex, "2B 0D 01"_hex, "5A 01 02"_hex}) {
        const Request request = Request::make(pdu, QuantityCheck::fit).value();
        EXPECT_EQ(request.pdu(), pdu);
        EXPECT_EQ(request.is_read(), is_pure_read(pdu)) << to_hex(pdu);
        EXPECT_EQ(request.span(), read_span(pdu)) << to_hex(pdu);
        EXPECT_EQ(request.reply_length(), reply_length_from_request(pdu)) << to_hex(pdu);
    }
    const Span span{Table::input_registers, 0x102, 127};
    EXPECT_EQ(Request::read(span).pdu(), "04 01 02 00 7F"_hex);
    EXPECT_EQ(Request::read(span).span(), span);
}

TEST(Request, WithAnyLengthHasNeitherASpanNorALengthOfItsReply) {
    const Request asked = Request::read({Table::input_registers, 1, 1});
    const Request any = asked.with_any_length();
    EXPECT_EQ(any.byte_count(), ByteCount::any);
    EXPECT_EQ(any.pdu(), asked.pdu());
    EXPECT_TRUE(any.is_read());
    EXPECT_EQ(any.span(), std::nullopt);
    EXPECT_EQ(any.reply_length(), std::nullopt);
    EXPECT_EQ(reply_length_from_request(any.pdu(), ByteCount::any), std::nullopt);
    EXPECT_EQ(any.access().read, asked.access().read) << "what is asked for stays known";
    EXPECT_NE(any, asked) << "one reply may not answer both";
    EXPECT_EQ(any, asked.with_any_length());
    for (const Bytes& pdu : {"06 00 01 00 03"_hex, read_write(2, 1), "07"_hex, "11"_hex}) {
        const Request other = Request::make(pdu, QuantityCheck::fit).value();
        EXPECT_EQ(other.with_any_length(), other) << to_hex(pdu);
        EXPECT_EQ(other.with_any_length().reply_length(), other.reply_length()) << to_hex(pdu);
    }
}

TEST(AccessOf, SaysWhatIsReadAndWritten) {
    const auto holding = [](std::uint16_t at, std::uint16_t n) {
        return Span{Table::holding_registers, at, n};
    };
    struct Row {
        Bytes pdu;
        std::optional<Span> read;
        std::optional<Span> write;
    };
    for (const Row& row :
         {Row{"01 01 20 00 05"_hex, Span{Table::coils, 0x0120, 5}, {}},
          Row{"02 00 00 00 01"_hex, Span{Table::discrete_inputs, 0, 1}, {}},
          Row{"03 00 6B 00 03"_hex, holding(0x6B, 3), {}},
          Row{"04 00 08 00 01"_hex, Span{Table::input_registers, 8, 1}, {}},
          Row{"05 00 AC FF 00"_hex, {}, Span{Table::coils, 0xAC, 1}},
          Row{"06 00 01 00 03"_hex, {}, holding(1, 1)},
          Row{write_coils(10), {}, Span{Table::coils, 0, 10}},
          Row{write_registers(4), {}, holding(0, 4)},
          Row{"16 00 04 00 F2 00 25"_hex, {}, holding(4, 1)},
          Row{"18 04 DE"_hex, holding(0x04DE, 1), {}},
          Row{"17 00 03 00 06 00 0E 00 01 02 00 FF"_hex, holding(3, 6), holding(14, 1)}, Row{}}) {
        EXPECT_EQ(access_of(row.pdu).read, row.read) << to_hex(row.pdu);
        EXPECT_EQ(access_of(row.pdu).write, row.write) << to_hex(row.pdu);
    }
    for (const Bytes& pdu : {"07"_hex, "08 00 00 00 01"_hex, "11"_hex, read_file(1),
                             "2B 0E 01 00"_hex, "41 00 01 00 02"_hex})
        EXPECT_FALSE(access_of(pdu).read || access_of(pdu).write) << to_hex(pdu);
}

TEST(ReadSpan, IsWhatOneOfTheFourReadsAsksFor) {
    EXPECT_EQ(read_span("04 01 02 00 7D"_hex), (Span{Table::input_registers, 0x102, 125}));
    for (const std::uint8_t function : "01 02 03 04"_hex) {
        const Bytes pdu = Writer().u8(function).u16(65535).u16(1).take();
        const auto last = read_span(pdu);
        ASSERT_TRUE(last);
        EXPECT_EQ(encode_read(*last), pdu);
    }
    // Nothing is read, or more than there is.
    for (const Bytes& pdu :
         {""_hex, "03"_hex, "03 00 00 00"_hex, "03 00 00 00 01 00"_hex, "03 00 00 00 00"_hex,
          "03 FF FF 00 02"_hex, "05 00 00 FF 00"_hex, "06 00 00 00 01"_hex, "83 00 00 00 01"_hex,
          "17 00 00 00 01 00 00 00 01 02 00 00"_hex, "00 00 00 00 01"_hex})
        EXPECT_FALSE(read_span(pdu)) << to_hex(pdu);
}

TEST(Request, IsAPureReadOrNeverAnsweredOnlyWhenSurelySo) {
    for (const Bytes& pdu : {"03 00 00 00 01"_hex, "2B 0E 01 00"_hex})
        EXPECT_TRUE(is_pure_read(pdu)) << to_hex(pdu);
    for (const Bytes& pdu :
         {"2B 0D 01"_hex, "2B"_hex, "08 00 00 00 01"_hex, read_write(1, 1), "5A"_hex, ""_hex})
        EXPECT_FALSE(is_pure_read(pdu)) << to_hex(pdu);
    EXPECT_TRUE(is_never_answered("08 00 04 00 00"_hex)) << "force listen only";
    for (const Bytes& pdu : {"08 04 00 00 00"_hex, "08 00 00 00 04"_hex, "06 00 04 00 00"_hex})
        EXPECT_FALSE(is_never_answered(pdu)) << to_hex(pdu);
}

TEST(Request, EncodesTheExamplesOfTheStandard) {
    EXPECT_EQ(encode_read(Table::coils, 0x13, 0x13), "01 00 13 00 13"_hex);
    EXPECT_EQ(encode_write_coil(0xAC, true), "05 00 AC FF 00"_hex);
    EXPECT_EQ(encode_write_coil(0xAC, false), "05 00 AC 00 00"_hex);
    EXPECT_EQ(encode_write_register(1, 3), "06 00 01 00 03"_hex);
    EXPECT_EQ(encode_write_registers(1, {0x000A, 0x0102}), "10 00 01 00 02 04 00 0A 01 02"_hex);
    EXPECT_EQ(
        encode_write_coils(0x13, {true, false, true, true, false, false, true, true, true, false}),
        "0F 00 13 00 0A 02 CD 01"_hex);
}

TEST(Request, PacksBitsFromTheLowEndAndPadsWithZeros) {
    EXPECT_EQ(pack_bits({}), Bytes());
    EXPECT_EQ(pack_bits({true, false, false, true, true}), "19"_hex);
    EXPECT_EQ(pack_bits(std::vector<bool>(9, true)), "FF 01"_hex);
}

TEST(RequestAduLength, IsThatOfFunctionAndByteCountOrUnknown) {
    for (const auto& [heard, length] :
         {std::pair("11 03 00 6B 00 03 76"_hex, 8u), std::pair("11 06 00 01 00 03 9A 9B"_hex, 8u),
          std::pair("11 10 00 01 00 02 04 00"_hex, 13u),
          std::pair("11 0F 00 13 00 0A 02 CD"_hex, 11u),
          std::pair("11 07 4C 22 00 00 00 00"_hex, 0u),
          std::pair("11 83 02 C1 34 00 00 00"_hex, 0u), std::pair("11 10 00 01 00 02"_hex, 0u),
          std::pair(""_hex, 0u)})
        EXPECT_EQ(request_adu_length(heard), length) << to_hex(heard);
}

TEST(DistinctByteCount, IsOfAReadWhoseAddressIsAnotherByte) {
    EXPECT_EQ(distinct_byte_count("03 00 64 00 03"_hex), 6);
    EXPECT_EQ(distinct_byte_count("01 04 64 00 14"_hex), 3);
    for (const Bytes& pdu :
         {"01 03 64 00 14"_hex, "06 00 01 00 02"_hex, "07"_hex, "0B"_hex, Bytes()})
        EXPECT_EQ(distinct_byte_count(pdu), std::nullopt) << to_hex(pdu);
}

}  // namespace
}  // namespace panelgate::modbus::request_test
