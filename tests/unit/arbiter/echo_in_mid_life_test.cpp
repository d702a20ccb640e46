// P8: an adapter, or a receiver that is stuck, begins to echo while the device stays open.
#include <gtest/gtest.h>

#include <algorithm>

#include "echo_fixture.hpp"
#include "panelgate/arbiter/reply_times.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter::echo::echo_in_mid_life_test {
namespace {

/// A line without an echo, whose station has answered; then a write, and its very frame comes back
/// as it leaves.
class EchoInMidLife : public Echo {
  protected:
    EchoInMidLife() {
        for (int i = 0; i < Quickest::kEnough; ++i) read_once(bus, false);
        write = bus.submit(17, kWriteRegister);
        hear_echo(bus);
        EXPECT_FALSE(bus.answered(write));
    }
    /// A read is sent that detects the echo.
    void ask() {
        ASSERT_TRUE(bus.next_sent(600ms));
        ASSERT_EQ(bus.sent.back().kind, FrameKind::learn_echo);
    }
    BusScript bus{settings(EchoMode::automatic)};
    Ticket write = 0;
};

TEST_F(EchoInMidLife, P8ConfirmsNoWriteOfAPanelThatIsOff) {
    ask();
    hear_echo(bus);
    bus.run_for(2s);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
    EXPECT_TRUE(bus.answer(write).transmitted);
    EXPECT_EQ(bus.arbiter().echo(), EchoState::present);
}

TEST_F(EchoInMidLife, P8ConfirmsNoWriteWhereTheReadIsAnsweredBehindAnEcho) {
    ask();
    hear_echo(bus);
    reply(bus, kReply);
    EXPECT_EQ(bus.answer(write).pdu.error(), Fault::timeout);
}

TEST_F(EchoInMidLife, P8TheReplyBehindItConfirmsTheWrite) {
    reply(bus, kWriteRegister);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWriteRegister);
    bus.run_for(200ms);
    bus.submit(17, kWriteRegister);
    EXPECT_EQ(bus.sent.back().kind, FrameKind::learn_echo) << "nothing is known of the echo";
}

TEST_F(EchoInMidLife, P2AnAnswerThatWasJustQuickConfirmsTheWriteOnce) {
    ask();
    bus.run_to_end_of_request();
    reply(bus, kReply);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWriteRegister);
    const auto writes = std::ranges::count_if(bus.sent, [](const auto& one) {
        return one.adu == modbus::encode_adu(17, kWriteRegister);
    });
    EXPECT_EQ(writes, 1);
}

TEST_F(EchoInMidLife, P2ARefusedReadDecidesAsWellAndTheWriteIsNotRepeated) {
    ask();
    bus.run_to_end_of_request();
    reply(bus, "83 02"_hex);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWriteRegister);
    EXPECT_FALSE(bus.next_sent(1s));
}

}  // namespace
}  // namespace panelgate::arbiter::echo::echo_in_mid_life_test
