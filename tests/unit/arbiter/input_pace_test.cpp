// When bytes are worth a look (P5): the request of an attempt leaves, then a reply comes.
#include "panelgate/arbiter/attempt.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::input_pace_test {
namespace {

using Expect = EchoFilter::Expect;
using modbus::encode_adu;

constexpr std::uint8_t kStation = 17;
const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kFrame = encode_adu(kStation, kRead);
const Bytes kReplyAdu = encode_adu(kStation, "03 06 02 2B 00 00 00 64"_hex);

Attempt attempt_of(const Bytes& pdu, EchoFilter echo = {}, const Settings& line = {}) {
    return {test::group_of(kStation, pdu),
            test::timing_of(TimePoint{1h}, pdu.size() + 3, line),
            std::move(echo),
            {}};
}

const Duration kByte = byte_time(SerialFormat{});

class InputPaceTest : public testing::Test {
  protected:
    /// Bytes `from` to `to` of the frame, whose byte n is there n + 1 byte times behind `start`.
    void come(const Bytes& frame, std::size_t from, std::size_t to, Duration late = {}) {
        now = start + to * kByte + late;
        attempt.on_rx(now, ByteView(frame).subspan(from, to - from));
    }
    /// Bytes decide nothing until so long behind `start`; empty: each byte may decide.
    std::optional<Duration> busy() const {
        const auto until = attempt.busy_until();
        return until && *until > now ? std::optional(*until - start) : std::nullopt;
    }

    Attempt attempt = attempt_of(kRead);
    TimePoint start = attempt.timing().sent + 5ms;
    TimePoint now{};
};

TEST_F(InputPaceTest, P5TheReplyIsLookedAtWhenItsHeaderAndWhenAllOfItIsThere) {
    EXPECT_FALSE(busy());
    come(kReplyAdu, 0, 1);
    EXPECT_EQ(busy(), 3 * kByte);
    come(kReplyAdu, 1, 3);
    EXPECT_EQ(busy(), 11 * kByte);
    come(kReplyAdu, 3, 10);
    EXPECT_EQ(busy(), 11 * kByte);
}

TEST_F(InputPaceTest, P5WhereBytesDoNotComeOneByOneEachMayDecide) {
    come(kReplyAdu, 0, 3, 0ms);
    now = start + 3 * kByte;
    attempt.on_rx(now, ByteView(kReplyAdu).subspan(3, 7));  // a USB latency timer
    EXPECT_FALSE(busy());
    Settings tcp;
    tcp.may_stall = true;
    attempt = attempt_of(kRead, {}, tcp);
    come(kReplyAdu, 0, 1);
    EXPECT_FALSE(attempt.busy_until());
}

TEST_F(InputPaceTest, P5ALongReplyIsLookedAtBeforeItsEndBecauseItMayHaveBeenCut) {
    attempt = attempt_of("03 00 6B 00 64"_hex);
    const Bytes whole = Writer().raw("11 03 C8"_hex).raw(Bytes(202, 7)).take();
    come(whole, 0, 3);
    EXPECT_EQ(busy(), 3 * kByte + timing::kLongestLook);
    come(whole, 3, 80);
    EXPECT_EQ(busy(), 160 * kByte) << "as long again";
}

TEST_F(InputPaceTest, P5AnEchoIsLookedAtWhenAllOfItCanHaveComeBack) {
    attempt = attempt_of(kRead, {kFrame, Expect::certainly});
    start = attempt.timing().started;
    come(kFrame, 0, 1);
    EXPECT_EQ(busy(), 8 * kByte);
    come(kFrame, 1, 8);
    EXPECT_FALSE(busy());
    start = attempt.timing().sent + 5ms;
    come(kReplyAdu, 0, 3);
    EXPECT_EQ(busy(), 11 * kByte);
    attempt = attempt_of(kRead, {kFrame, Expect::perhaps});
    start = attempt.timing().started;
    come(kFrame, 0, 1);
    EXPECT_EQ(busy(), 3 * kByte) << "a reply begins like its request";
}

}  // namespace
}  // namespace panelgate::arbiter::input_pace_test
