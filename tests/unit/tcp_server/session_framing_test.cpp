#include "loopback.hpp"

namespace panelgate::tcp_server::session_framing_test {
namespace {

// Framing errors: MBAP-05 to MBAP-07.
class SessionFraming : public Loopback {};

TEST_F(SessionFraming, SkipsAnotherProtocolAndServesTheNextRequest) {
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();
    const Bytes foreign = "0001 0001 0006 01 03 0000 0001"_hex;
    client.send(foreign + foreign);
    EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(listener->counters().protocol_errors, 2U);
    client.send(foreign + foreign);
    EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1)) << "a good one in between starts anew";
    client.send(foreign + foreign + foreign);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 7U);
}

class BadLength : public Loopback, public ::testing::WithParamInterface<std::uint16_t> {};

TEST_P(BadLength, ClosesOnlyThatConnection) {
    bus1.instant = reply_to_read(1);
    start();
    Client bystander = connect();
    Client client = connect();
    client.send(Writer().u16(1).u16(0).u16(GetParam()).u8(1).u8(3).take());
    EXPECT_TRUE(client.sees_close());
    EXPECT_FALSE(client.has_input()) << "closed without a reply";
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
    EXPECT_EQ(bystander.ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(listener->counters().connections, 1U);
}
INSTANTIATE_TEST_SUITE_P(Lengths, BadLength, ::testing::Values(0, 1, 255, 65535));

TEST_F(SessionFraming, TakesTheShortestAndTheLongestLength) {
    bus1.instant = "07 00"_hex;
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(1, "07"_hex), "07 00"_hex);
    EXPECT_EQ(client.ask(1, "41"_hex + Bytes(252, 1)), "07 00"_hex);
    EXPECT_EQ(bus1.seen.back().request.pdu().size(), 253U);
}

TEST_F(SessionFraming, ClosesAConnectionThatSendsHalfAnAdu) {
    bus1.instant = reply_to_read(1);
    start();
    Client idle = connect();
    Client client = connect();
    client.send("0001 0000"_hex);
    ASSERT_TRUE(run_until_armed());
    clock.advance(settings.partial_adu_timeout - 1ns);
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
    clock.advance(1ns);
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
    EXPECT_EQ(idle.ask(1, read_pdu(1)), reply_to_read(1)) << "silence alone is no fault";
}

TEST_F(SessionFraming, DoesNotLetDribblingBytesStretchTheTime) {
    settings.partial_adu_timeout = 50ms;
    start();
    Client client = connect();
    client.send("0001 0000 00fe 01"_hex);
    ASSERT_TRUE(run_until_armed());
    const auto end = clock.next();
    // Sending all 260 bytes would take far longer than an ADU is allowed.
    for (int i = 0; i < 9; ++i) {
        client.send("41"_hex);
        context.restart();
        context.poll();
        clock.advance(5ms);
        ASSERT_EQ(clock.next(), end);
    }
    clock.advance(5ms);
    EXPECT_EQ(listener->counters().protocol_errors, 1U);
    EXPECT_TRUE(client.sees_close());
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(SessionFraming, TheNextAduHasATimeOfItsOwn) {
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();
    client.send("0001 0000"_hex);
    ASSERT_TRUE(run_until_armed());
    const auto first = clock.next();
    clock.advance(1ms);
    client.send("0006 01 03 0000 0001 0002"_hex);  // its rest and the start of the next
    EXPECT_EQ(client.receive()->pdu, reply_to_read(1));
    ASSERT_TRUE(clock.next());
    EXPECT_EQ(*clock.next() - *first, 1ms);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_framing_test
