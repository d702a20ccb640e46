#include "panelgate/arbiter/outstanding.hpp"

#include <gtest/gtest.h>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::questions_test {
namespace {

using modbus::encode_adu;

TimePoint at(Duration since) { return TimePoint{} + since; }

TEST(ForeignRequests, MatchWhatMayAnswerOneOfThem) {
    ForeignRequests requests;
    Bytes heard = encode_adu(17, "03 00 00 00 01"_hex);
    heard.push_back(0x55);  // more bytes follow
    requests.on_heard(at(1s), heard);
    EXPECT_TRUE(requests.fit(encode_adu(17, "03 02 00 07"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(17, "83 02"_hex)));
    EXPECT_FALSE(requests.fit(encode_adu(18, "03 02 00 07"_hex)));
    EXPECT_FALSE(requests.fit(encode_adu(17, "03 04 00 07 00 08"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(17, "83 02"_hex), at(1s)));
    EXPECT_FALSE(requests.fit(encode_adu(17, "83 02"_hex), at(2s)));
    requests.clear();
    EXPECT_FALSE(requests.fit(encode_adu(17, "83 02"_hex)));
}

TEST(ForeignRequests, ABroadcastHasNoAnswer) {
    ForeignRequests requests;
    requests.on_heard(at(1s), encode_adu(0, "06 00 01 00 03"_hex));
    EXPECT_FALSE(requests.fit(encode_adu(0, "06 00 01 00 03"_hex)));
}

TEST(ForeignRequests, ForgetTheOldestOfTooMany) {
    ForeignRequests requests;
    for (unsigned i = 1; i <= ForeignRequests::kMost + 1; ++i)
        requests.on_heard(at(1s), encode_adu(static_cast<std::uint8_t>(i), "03 00 00 00 01"_hex));
    EXPECT_FALSE(requests.fit(encode_adu(1, "03 02 00 07"_hex)));
    EXPECT_TRUE(requests.fit(encode_adu(2, "03 02 00 07"_hex)));
}

}  // namespace
}  // namespace panelgate::arbiter::questions_test
