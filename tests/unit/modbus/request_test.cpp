#include "panelgate/modbus/request.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::modbus::request_test {
namespace {

bool passes(const Bytes& pdu, QuantityCheck check = QuantityCheck::fit) {
    return check_request(pdu, check).has_value();
}
bool passes_wide(const Bytes& pdu) { return passes(pdu, QuantityCheck::wide); }

Fault fault_of(const Bytes& pdu, QuantityCheck check = QuantityCheck::fit) {
    return check_request(pdu, check).error();
}

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
Bytes read_file(unsigned n) {
    Writer out;
    out.u8(0x14).u8(7).u8(6).u16(1).u16(0).u16(n);
    return out.take();
}

TEST(CheckRequest, CallsAnEmptyPduMalformed) { EXPECT_EQ(fault_of({}), Fault::malformed); }

TEST(CheckRequest, DeniesFunctionZeroAndTheReplyRangeWhateverFollows) {
    EXPECT_EQ(fault_of("00"_hex), Fault::denied);
    EXPECT_EQ(fault_of("80"_hex), Fault::denied);
    EXPECT_EQ(fault_of("83 00 00 00 01"_hex), Fault::denied);
    EXPECT_EQ(fault_of("FF"_hex), Fault::denied);
    EXPECT_EQ(fault_of(Bytes(300, 0)), Fault::denied);
}

/// Functions whose requests have one length (PDU-07): a byte less or more contradicts them.
TEST(CheckRequest, WantsTheLengthOfTheFunction) {
    const Bytes requests[] = {"01 00 13 00 13"_hex,
                              "02 00 C4 00 16"_hex,
                              "03 00 6B 00 03"_hex,
                              "04 00 08 00 01"_hex,
                              "05 00 AC FF 00"_hex,
                              "06 00 01 00 03"_hex,
                              "07"_hex,
                              "0B"_hex,
                              "0C"_hex,
                              "11"_hex,
                              "18 04 DE"_hex,
                              "2B 0E 01 00"_hex,
                              write_coils(10),
                              write_registers(2),
                              "16 00 04 00 F2 00 25"_hex,
                              read_write(6, 3),
                              read_file(2),
                              "15 0B 06 00 04 00 07 00 02 06 AF 04 BE"_hex};
    for (const Bytes& good : requests) {
        EXPECT_TRUE(passes(good)) << to_hex(good);
        Bytes longer = good;
        longer.push_back(0);
        EXPECT_EQ(fault_of(longer), Fault::malformed) << to_hex(longer);
        const Bytes shorter(good.begin(), good.end() - 1);
        EXPECT_EQ(fault_of(shorter), Fault::malformed) << to_hex(shorter);
    }
}

TEST(CheckRequest, WantsTheByteCountThatTheQuantityNeeds) {
    EXPECT_FALSE(passes("10 00 01 00 01 04 00 01"_hex));
    EXPECT_FALSE(passes("10 00 01 00 01 04 00 01 00 02"_hex));
    EXPECT_FALSE(passes("0F 00 01 00 09 01 FF"_hex));
    EXPECT_TRUE(passes("0F 00 01 00 08 01 FF"_hex));
    EXPECT_FALSE(passes("17 00 00 00 01 00 00 00 02 02 00 01"_hex));
    EXPECT_FALSE(passes("10 00 01 00 81 02 00 01"_hex)) << "258 bytes are not the 2 that they look";
}

TEST(CheckRequest, WantsWholeSubRequests) {
    EXPECT_TRUE(passes("14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 02"_hex));
    EXPECT_FALSE(passes("14 08 06 00 04 00 01 00 02 06"_hex));
    EXPECT_FALSE(passes("15 0D 06 00 04 00 07 00 02 06 AF 04 BE 10 0D"_hex));
    EXPECT_FALSE(passes("15 0D 06 00 04 00 07 00 04 06 AF 04 BE 10 0D"_hex));
}

TEST(CheckRequest, WantsAtLeastOneDataWordInDiagnostics) {
    EXPECT_FALSE(passes("08"_hex));
    EXPECT_FALSE(passes("08 00 00"_hex));
    EXPECT_FALSE(passes("08 00 00 A5"_hex));
    EXPECT_TRUE(passes("08 00 00 A5 37"_hex));
    EXPECT_TRUE(passes("08 00 00 A5 37 01 02"_hex));
    EXPECT_FALSE(passes("08 00 00 A5 37 01"_hex));
}

TEST(CheckRequest, HasNoRuleForOtherMeiTypesAndUnknownFunctions) {
    EXPECT_TRUE(passes("2B 0D"_hex));
    EXPECT_TRUE(passes("2B 0D 01 02 03"_hex));
    EXPECT_FALSE(passes("2B"_hex));
    EXPECT_TRUE(passes("41"_hex));
    EXPECT_TRUE(passes("5A 01 02 03"_hex));
    EXPECT_TRUE(passes(Bytes(253, 0x41)));
    EXPECT_EQ(fault_of(Bytes(254, 0x41)), Fault::malformed);
}

TEST(CheckRequest, RefusesWhatNoReplyCouldCarry) {
    EXPECT_TRUE(passes(encode_read(Table::holding_registers, 0, 125)));
    EXPECT_EQ(fault_of(encode_read(Table::holding_registers, 0, 126)), Fault::malformed);
    EXPECT_EQ(fault_of(encode_read(Table::input_registers, 0, 126)), Fault::malformed);
    EXPECT_TRUE(passes(encode_read(Table::coils, 0, 2008)));
    EXPECT_EQ(fault_of(encode_read(Table::coils, 0, 2009)), Fault::malformed);
    EXPECT_EQ(fault_of(encode_read(Table::discrete_inputs, 0, 0xFFFF)), Fault::malformed);
    EXPECT_TRUE(passes(read_write(125, 121)));
    EXPECT_EQ(fault_of(read_write(126, 1)), Fault::malformed);
    EXPECT_TRUE(passes(read_file(124))) << "2 + 248 bytes";
    EXPECT_EQ(fault_of(read_file(125)), Fault::malformed) << "2 + 250 bytes";
}

TEST(CheckRequest, RefusesPdusOver253Bytes) {
    EXPECT_TRUE(passes(write_registers(123)));
    EXPECT_EQ(fault_of(write_registers(124)), Fault::malformed);
    EXPECT_TRUE(passes(write_coils(1976))) << "247 bytes of data";
    EXPECT_EQ(fault_of(write_coils(1977)), Fault::malformed);
    EXPECT_EQ(fault_of(read_write(1, 122)), Fault::malformed);
}

TEST(CheckRequest, LetsOneByteOfByteCountPassWhenWide) {
    EXPECT_TRUE(passes_wide(encode_read(Table::holding_registers, 0, 127)));
    EXPECT_FALSE(passes_wide(encode_read(Table::holding_registers, 0, 128)));
    EXPECT_TRUE(passes_wide(encode_read(Table::coils, 0, 2040)));
    EXPECT_FALSE(passes_wide(encode_read(Table::coils, 0, 2041)));
    EXPECT_EQ(write_registers(127).size(), 260u);
    EXPECT_TRUE(passes_wide(write_registers(127)));
    EXPECT_EQ(write_coils(2040).size(), kMaxLongRequestPdu);
    EXPECT_TRUE(passes_wide(write_coils(2040)));
    EXPECT_EQ(fault_of(Bytes(262, 0x41), QuantityCheck::wide), Fault::malformed);
    EXPECT_EQ(fault_of("03 00 00 00"_hex, QuantityCheck::wide), Fault::malformed);
}

TEST(CheckRequest, LeavesTheRestToThePanel) {
    EXPECT_TRUE(passes("03 00 00 00 00"_hex)) << "quantity 0";
    EXPECT_TRUE(passes("10 00 00 00 00 00"_hex)) << "quantity 0";
    EXPECT_TRUE(passes("03 FF FF 00 02"_hex)) << "beyond the last address";
    EXPECT_TRUE(passes("05 00 00 12 34"_hex)) << "neither on nor off";
    EXPECT_TRUE(passes("0F 00 00 00 01 01 FF"_hex)) << "pad bits";
    EXPECT_TRUE(passes("14 07 09 00 01 00 00 00 01"_hex)) << "reference type";
}

TEST(ReplyLengthFromRequest, CountsAddressAndCrc) {
    EXPECT_EQ(reply_length_from_request("01 00 00 00 08"_hex), 6u);
    EXPECT_EQ(reply_length_from_request("01 00 00 00 09"_hex), 7u);
    EXPECT_EQ(reply_length_from_request("03 00 00 FF FF"_hex), 5u + 2 * 65535);
    EXPECT_EQ(reply_length_from_request("08 00 00 01 02 03 04"_hex), 10u);
    EXPECT_EQ(reply_length_from_request("08 00 0B 00 00"_hex), 8u);
    EXPECT_EQ(reply_length_from_request("08 00 04 00 00"_hex), 0u);
    EXPECT_EQ(reply_length_from_request(read_write(6, 3)), 17u);
}

TEST(ReplyLengthFromRequest, DoesNotGuess) {
    for (const Bytes& pdu : {Bytes(), "0C"_hex, "11"_hex, "18 00 00"_hex, "2B 0E 01 00"_hex,
                             "2B 0D 00"_hex, "41 00"_hex}) {
        EXPECT_FALSE(reply_length_from_request(pdu)) << to_hex(pdu);
    }
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
        EXPECT_EQ(request.function(), pdu[0]);
        EXPECT_EQ(request.is_read(), is_pure_read(pdu)) << to_hex(pdu);
        EXPECT_EQ(request.is_broadcastable(), is_broadcastable(pdu[0])) << to_hex(pdu);
        EXPECT_EQ(request.is_never_answered(), is_never_answered(pdu)) << to_hex(pdu);
        EXPECT_EQ(request.span(), read_span(pdu)) << to_hex(pdu);
        EXPECT_EQ(request.access().read, access_of(pdu).read) << to_hex(pdu);
        EXPECT_EQ(request.access().write, access_of(pdu).write) << to_hex(pdu);
        EXPECT_EQ(request.reply_length(), reply_length_from_request(pdu)) << to_hex(pdu);
    }
}

TEST(Request, OfASpanReadsIt) {
    const Span span{Table::input_registers, 0x102, 127};
    EXPECT_EQ(Request::read(span).pdu(), "04 01 02 00 7F"_hex);
    EXPECT_EQ(Request::read(span).span(), span);
}

TEST(AccessOf, SaysWhatIsReadAndWritten) {
    const auto holding = [](std::uint16_t at, std::uint16_t n) {
        return Span{Table::holding_registers, at, n};
    };
    EXPECT_EQ(access_of("01 01 20 00 05"_hex).read, (Span{Table::coils, 0x0120, 5}));
    EXPECT_EQ(access_of("02 00 00 00 01"_hex).read, (Span{Table::discrete_inputs, 0, 1}));
    EXPECT_EQ(access_of("03 00 6B 00 03"_hex).read, holding(0x6B, 3));
    EXPECT_EQ(access_of("04 00 08 00 01"_hex).read, (Span{Table::input_registers, 8, 1}));
    EXPECT_EQ(access_of("05 00 AC FF 00"_hex).write, (Span{Table::coils, 0xAC, 1}));
    EXPECT_EQ(access_of("06 00 01 00 03"_hex).write, holding(1, 1));
    EXPECT_EQ(access_of(write_coils(10)).write, (Span{Table::coils, 0, 10}));
    EXPECT_EQ(access_of(write_registers(4)).write, holding(0, 4));
    EXPECT_EQ(access_of("16 00 04 00 F2 00 25"_hex).write, holding(4, 1));
    EXPECT_EQ(access_of("18 04 DE"_hex).read, holding(0x04DE, 1));
    const Access both = access_of("17 00 03 00 06 00 0E 00 01 02 00 FF"_hex);
    EXPECT_EQ(both.read, holding(3, 6));
    EXPECT_EQ(both.write, holding(14, 1));
    EXPECT_FALSE(access_of("06 00 01 00 03"_hex).read);
}

TEST(AccessOf, IsNothingForFunctionsWithoutAddresses) {
    for (const Bytes& pdu : {Bytes(), "07"_hex, "08 00 00 00 01"_hex, "11"_hex, read_file(1),
                             "2B 0E 01 00"_hex, "41 00 01 00 02"_hex}) {
        const Access access = access_of(pdu);
        EXPECT_FALSE(access.read || access.write) << to_hex(pdu);
    }
}

TEST(ReadSpan, IsWhatOneOfTheFourReadsAsksFor) {
    EXPECT_EQ(read_span("04 01 02 00 7D"_hex), (Span{Table::input_registers, 0x102, 125}));
    for (const std::uint8_t function : "01 02 03 04"_hex) {
        const Bytes pdu = Writer().u8(function).u16(65535).u16(1).take();
        const auto last = read_span(pdu);
        ASSERT_TRUE(last);
        EXPECT_EQ(encode_read(*last), pdu);
    }
}

TEST(ReadSpan, IsNoneWhereNothingIsReadOrMoreThanThereIs) {
    for (const Bytes& pdu :
         {""_hex, "03"_hex, "03 00 00 00"_hex, "03 00 00 00 01 00"_hex, "03 00 00 00 00"_hex,
          "03 FF FF 00 02"_hex, "05 00 00 FF 00"_hex, "06 00 00 00 01"_hex, "83 00 00 00 01"_hex,
          "17 00 00 00 01 00 00 00 01 02 00 00"_hex, "00 00 00 00 01"_hex}) {
        EXPECT_FALSE(read_span(pdu)) << to_hex(pdu);
    }
}

TEST(Request, IsAPureReadOnlyWhenSurelyOne) {
    EXPECT_TRUE(is_pure_read("03 00 00 00 01"_hex));
    EXPECT_TRUE(is_pure_read("2B 0E 01 00"_hex));
    EXPECT_FALSE(is_pure_read("2B 0D 01"_hex));
    EXPECT_FALSE(is_pure_read("2B"_hex));
    EXPECT_FALSE(is_pure_read("08 00 00 00 01"_hex));
    EXPECT_FALSE(is_pure_read(read_write(1, 1)));
    EXPECT_FALSE(is_pure_read("5A"_hex));
    EXPECT_FALSE(is_pure_read({}));
}

TEST(Request, OnlyForceListenOnlyIsNeverAnswered) {
    EXPECT_TRUE(is_never_answered("08 00 04 00 00"_hex));
    EXPECT_FALSE(is_never_answered("08 04 00 00 00"_hex));
    EXPECT_FALSE(is_never_answered("08 00 00 00 04"_hex));
    EXPECT_FALSE(is_never_answered("06 00 04 00 00"_hex));
}

TEST(Request, EncodesTheExamplesOfTheStandard) {
    EXPECT_EQ(encode_read(Table::coils, 0x13, 0x13), "01 00 13 00 13"_hex);
    EXPECT_EQ(encode_write_coil(0xAC, true), "05 00 AC FF 00"_hex);
    EXPECT_EQ(encode_write_coil(0xAC, false), "05 00 AC 00 00"_hex);
    EXPECT_EQ(encode_write_register(1, 3), "06 00 01 00 03"_hex);
    EXPECT_EQ(encode_write_registers(1, {0x000A, 0x0102}), "10 00 01 00 02 04 00 0A 01 02"_hex);
    const std::vector<bool> coils = {true,  false, true, true, false,
                                     false, true,  true, true, false};
    EXPECT_EQ(encode_write_coils(0x13, coils), "0F 00 13 00 0A 02 CD 01"_hex);
}

TEST(Request, PacksBitsFromTheLowEndAndPadsWithZeros) {
    EXPECT_EQ(pack_bits({}), Bytes());
    EXPECT_EQ(pack_bits({true, false, false, true, true}), "19"_hex);
    EXPECT_EQ(pack_bits(std::vector<bool>(9, true)), "FF 01"_hex);
}

TEST(RequestAduLength, IsDeterminedByFunctionAndByteCount) {
    EXPECT_EQ(request_adu_length("11 03 00 6B 00 03 76"_hex), 8u);
    EXPECT_EQ(request_adu_length("11 06 00 01 00 03 9A 9B"_hex), 8u);
    EXPECT_EQ(request_adu_length("11 10 00 01 00 02 04 00"_hex), 13u);
    EXPECT_EQ(request_adu_length("11 0F 00 13 00 0A 02 CD"_hex), 11u);
}

TEST(RequestAduLength, IsUnknownForOtherFunctionsAndTooFewBytes) {
    EXPECT_EQ(request_adu_length("11 07 4C 22 00 00 00 00"_hex), 0u);
    EXPECT_EQ(request_adu_length("11 83 02 C1 34 00 00 00"_hex), 0u);
    EXPECT_EQ(request_adu_length("11 10 00 01 00 02"_hex), 0u);
    EXPECT_EQ(request_adu_length({}), 0u);
}

}  // namespace
}  // namespace panelgate::modbus::request_test
