#include <gmock/gmock.h>

#include "panelgate/modbus/rtu_frame.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::echo_test {
namespace {

using modbus::encode_adu;
using testing::IsEmpty;
using testing::SizeIs;

const Bytes kWrite = modbus::encode_write_register(1, 2);  // its reply is the same
const Bytes kWriteRequest = encode_adu(kOurs, kWrite);

Talk with(EchoMode mode) {
    Settings settings = Talk::rtu();
    settings.echo = mode;
    return Talk(settings);
}

/// Echoes the last transmission.
void echo_last(Talk& talk) {
    const Bytes echo = talk.sent.back();
    talk.hear_slowly(echo, 1ms);
}

void exchange(Talk& talk, const Bytes& request, const Bytes& reply) {
    talk.hear(encode_adu(kOurs, request));
    talk.pass(10ms);
    talk.answer(reply);
}

TEST(OwnEcho, OfAWriteIsNotARequest) {
    Talk talk = with(EchoMode::automatic);
    exchange(talk, kWrite, kWrite);
    echo_last(talk);
    talk.pass(1s);
    EXPECT_THAT(talk.asks, SizeIs(1));
    exchange(talk, kWrite, kWrite);
    EXPECT_THAT(talk.asks, SizeIs(2));
}

TEST(OwnEcho, IsNoFaultAndNoWordOfTheMaster) {
    Talk talk = with(EchoMode::automatic);
    for (int i = 0; i < 3; ++i) {
        exchange(talk, kReadOne, kOneValue);
        echo_last(talk);
        talk.pass(100ms);
    }
    EXPECT_THAT(talk.sent, SizeIs(3));
    EXPECT_EQ(talk.machine.counters().damaged, 0u);
}

TEST(OwnEcho, ThatIsKnownToBeAbsentHidesNoRetry) {
    Talk talk = with(EchoMode::automatic);
    exchange(talk, kReadOne, kOneValue);  // no echo
    talk.pass(1s);
    exchange(talk, kWrite, kWrite);
    talk.pass(15ms);
    talk.hear(kWriteRequest);  // the reply was damaged there
    EXPECT_THAT(talk.asks, SizeIs(3));
}

TEST(OwnEcho, ThatIsLookedAtLateIsOneStill) {
    Talk talk = with(EchoMode::automatic);
    exchange(talk, kWrite, kWrite);
    talk.now += 5s;  // the process was stalled
    talk.hear(talk.sent.back());
    talk.pass(1s);
    EXPECT_THAT(talk.asks, SizeIs(1));
}

TEST(OwnEcho, ThatCameDamagedIsNotAbsent) {
    Talk talk = with(EchoMode::automatic);
    exchange(talk, kReadOne, kOneValue);
    Bytes met = talk.sent.back();  // collided with the master
    for (std::uint8_t& byte : met) byte ^= 0x5A;
    talk.hear_slowly(met, 1ms);
    talk.pass(1s);
    exchange(talk, kWrite, kWrite);
    echo_last(talk);
    talk.pass(1s);
    EXPECT_THAT(talk.asks, SizeIs(2));
}

TEST(OwnEcho, ThatMayBeARetryHidesItOnceAtMost) {
    Talk talk = with(EchoMode::automatic);
    exchange(talk, kWrite, kWrite);
    talk.pass(15ms);
    talk.hear(kWriteRequest);
    EXPECT_THAT(talk.asks, SizeIs(1));
    talk.pass(500ms);
    talk.hear(kWriteRequest);
    EXPECT_THAT(talk.asks, SizeIs(2));
}

TEST(OwnEcho, OnlyBegunLeavesTheMastersRequestWhole) {
    Talk talk = with(EchoMode::on);
    exchange(talk, kReadOne, kOneValue);
    talk.pass(20ms);
    talk.hear_slowly(encode_adu(kOurs, kReadOne), 1ms);  // begins as the reply did
    EXPECT_THAT(talk.asks, SizeIs(2));
}

}  // namespace
}  // namespace panelgate::serial_server::test::echo_test
