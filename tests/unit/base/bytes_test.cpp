#include "panelgate/base/bytes.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::bytes_test {
namespace {

TEST(Reader, ReadsBigEndian) {
    const Bytes bytes = "01 02 03 04 05"_hex;
    Reader in(bytes);
    EXPECT_EQ(in.u8(), 0x01);
    EXPECT_EQ(in.u16(), 0x0203);
    EXPECT_EQ(in.left(), 2u);
    const ByteView rest = in.take(2);
    EXPECT_EQ(Bytes(rest.begin(), rest.end()), "04 05"_hex);
    EXPECT_TRUE(in.finished());
}

TEST(Reader, CallsLeftoversUnfinished) {
    const Bytes bytes = "01 02"_hex;
    Reader in(bytes);
    in.u8();
    EXPECT_TRUE(in.ok());
    EXPECT_FALSE(in.finished());
}

TEST(Reader, StaysFailedOnceItReadPastTheEnd) {
    const Bytes bytes = "01"_hex;
    Reader in(bytes);
    EXPECT_EQ(in.u16(), 0);
    EXPECT_FALSE(in.ok());
    EXPECT_EQ(in.u8(), 0) << "although a byte is left";
    EXPECT_TRUE(in.take(1).empty());
    EXPECT_FALSE(in.finished());
}

TEST(Reader, TakesNothingFromNothing) {
    Reader in({});
    EXPECT_TRUE(in.take(0).empty());
    EXPECT_TRUE(in.finished());
    EXPECT_EQ(in.u8(), 0);
    EXPECT_FALSE(in.finished());
}

TEST(Writer, WritesBigEndianAndCutsToSize) {
    Writer out;
    out.u8(0x101).u16(0x10203).raw("04 05"_hex);
    EXPECT_EQ(out.take(), "01 02 03 04 05"_hex);
}

TEST(Hex, IsLowerCaseWithTheSeparator) {
    const Bytes bytes = {0x1F, 0x03, 0x00};
    EXPECT_EQ(to_hex(bytes), "1f 03 00");
    EXPECT_EQ(to_hex(bytes, ""), "1f0300");
    EXPECT_EQ(to_hex({}), "");
}

TEST(Hex, ReadsPairsWithOrWithoutBlanks) {
    const Bytes bytes = {0x1F, 0x03, 0xAB};
    EXPECT_EQ(from_hex("1f 03 AB"), bytes);
    EXPECT_EQ(from_hex(" 1F03  aB "), bytes);
    EXPECT_EQ(from_hex(""), Bytes());
}

TEST(Hex, RefusesEverythingElse) {
    for (const char* text : {"1", "1f 0", "1 f", "1f,03", "0x1f", "1g", "g1", "1f\n03"}) {
        EXPECT_FALSE(from_hex(text)) << text;
    }
}

TEST(Hex, ComesBackAsItWent) {
    Bytes bytes;
    for (int i = 0; i < 256; ++i) bytes.push_back(static_cast<std::uint8_t>(i));
    EXPECT_EQ(from_hex(to_hex(bytes)), bytes);
    EXPECT_EQ(from_hex(to_hex(bytes, "")), bytes);
}

TEST(Bytes, AreAppendedUpToALimit) {
    Bytes bytes{1, 2};
    const Bytes more{3, 4, 5};
    append_up_to(4, bytes, more);
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4}));
    append_up_to(4, bytes, more);
    append_up_to(3, bytes, more);  // beyond it already
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4}));
    append_up_to(9, bytes, more);
    EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4, 3, 4, 5}));
}

}  // namespace
}  // namespace panelgate::bytes_test
