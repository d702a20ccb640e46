#include "diagnostics.hpp"

#include <gtest/gtest.h>

#include "support/hex.hpp"

namespace panelgate::tcp_server {
namespace {

Diagnostics two_lines() {
    Diagnostics state;
    state.uptime = 65537s;
    state.lines = {{true, 3, 12.34}, {false, 100000, 0}};
    state.version = "1.2";
    return state;
}

Bytes ask(const Bytes& request) { return answer_diagnostics(request, two_lines()); }

TEST(Diagnostics, ShowsTheWholeMapToBothRegisterReads) {
    EXPECT_EQ(ask("03 0000 000a"_hex),
              "03 14 0001 0002 0001 0001 0001 0003 007b 0000 ffff 0000"_hex);
    EXPECT_EQ(ask("04 0004 0002"_hex), "04 04 0001 0003"_hex);
}

TEST(Diagnostics, KnowsNothingBeyondTheMap) {
    EXPECT_EQ(ask("03 0009 0002"_hex), "83 02"_hex);
    EXPECT_EQ(ask("03 ffff 0001"_hex), "83 02"_hex);
}

TEST(Diagnostics, RefusesMalformedRequests) {
    EXPECT_EQ(ask("03 0000 0000"_hex), "83 03"_hex);
    EXPECT_EQ(ask("03 0000 007e"_hex), "83 03"_hex);
    EXPECT_EQ(ask("03 0000"_hex), "83 03"_hex);
    EXPECT_EQ(ask("2b 0e 01"_hex), "ab 03"_hex);
    EXPECT_EQ(ask("2b"_hex), "ab 03"_hex);
    EXPECT_EQ(ask("2b 0e 05 00"_hex), "ab 03"_hex);
}

TEST(Diagnostics, RefusesEveryOtherFunction) {
    for (const char* request : {"01 0000 0001", "06 0000 0001", "07", "08 0000 0000", "0b", "11"}) {
        const Bytes pdu = *from_hex(request);
        EXPECT_EQ(ask(pdu), (Bytes{static_cast<std::uint8_t>(pdu[0] | 0x80), 1})) << request;
    }
    EXPECT_EQ(ask("2b 0d 01 00"_hex), "ab 01"_hex);
}

TEST(Diagnostics, IdentifiesItself) {
    EXPECT_EQ(ask("2b 0e 01 00"_hex),
              "2b 0e 01 81 00 00 03"
              "00 09 70616e656c67617465"
              "01 09 70616e656c67617465"
              "02 03 312e32"_hex);
    EXPECT_EQ(ask("2b 0e 04 02"_hex), "2b 0e 04 81 00 00 01 02 03 312e32"_hex);
    EXPECT_EQ(ask("2b 0e 04 03"_hex), "ab 02"_hex);
    EXPECT_EQ(ask("2b 0e 03 80"_hex).size(), ask("2b 0e 01 00"_hex).size()) << "restarts";
}

}  // namespace
}  // namespace panelgate::tcp_server
