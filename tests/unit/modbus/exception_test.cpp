#include "panelgate/modbus/function.hpp"

#include <gtest/gtest.h>

#include <map>

#include "support/hex.hpp"

namespace panelgate::modbus::exception_test {
namespace {

TEST(Exception, ReportsTheResultOfItsRequestToTheClient) {
    const std::map<Fault, unsigned> codes = {
        {Fault::denied, 0x01},    {Fault::malformed, 0x03}, {Fault::busy, 0x06},
        {Fault::expired, 0x06},   {Fault::line_down, 0x0A}, {Fault::not_routed, 0x0A},
        {Fault::cancelled, 0x0A}, {Fault::line_lost, 0x0B}, {Fault::timeout, 0x0B},
        {Fault::damaged, 0x0B},   {Fault::offline, 0x0B}};
    for (const Fault fault : kAllFaults) {
        EXPECT_EQ(static_cast<unsigned>(to_exception(fault)), codes.at(fault)) << label(fault);
    }
}

TEST(Exception, SetsTheHighBitOfTheFunction) {
    EXPECT_EQ(encode_exception(0x03, ExceptionCode::illegal_data_value), "83 03"_hex);
    EXPECT_EQ(encode_exception(0x00, ExceptionCode::illegal_function), "80 01"_hex);
    EXPECT_EQ(encode_exception(0x83, ExceptionCode::illegal_function), "83 01"_hex);
}

TEST(Exception, IsTwoBytesWithTheHighBitSet) {
    EXPECT_EQ(exception_of("83 02"_hex), 2);
    EXPECT_EQ(exception_of("83 41"_hex), 0x41) << "vendors' codes pass";
    EXPECT_FALSE(exception_of("03 02"_hex));
    EXPECT_FALSE(exception_of("83"_hex));
    EXPECT_FALSE(exception_of("83 02 00"_hex));
    EXPECT_FALSE(exception_of({}));
}

TEST(Exception, HasAWordForEveryCodeOfTheStandard) {
    EXPECT_EQ(describe_exception(0x01), "illegal function");
    EXPECT_EQ(describe_exception(0x02), "illegal data address");
    EXPECT_EQ(describe_exception(0x03), "illegal data value");
    EXPECT_EQ(describe_exception(0x04), "server device failure");
    EXPECT_EQ(describe_exception(0x05), "acknowledge");
    EXPECT_EQ(describe_exception(0x06), "server device busy");
    EXPECT_EQ(describe_exception(0x08), "memory parity error");
    EXPECT_EQ(describe_exception(0x0A), "gateway path unavailable");
    EXPECT_EQ(describe_exception(0x0B), "gateway target device failed to respond");
}

TEST(Exception, CallsTheOthersByTheirNumber) {
    for (const int code : {0, 7, 9, 12, 255}) {
        EXPECT_EQ(describe_exception(static_cast<std::uint8_t>(code)),
                  "exception " + std::to_string(code));
    }
}

}  // namespace
}  // namespace panelgate::modbus::exception_test
