#include "loopback.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::tcp_server::session_broadcast_test {
namespace {

// TBC-02 to TBC-06.
class SessionBroadcast : public Loopback {
  protected:
    SessionBroadcast() { bus1.rights = {}; }
};

const Bytes kWrite = "10 0064 0001 02 00ff"_hex;
const Bytes kWritten = "10 0064 0001"_hex;

TEST_F(SessionBroadcast, AnswersABroadcastAsSoonAsItHasLeft) {
    start();
    Client client = connect();
    client.request(1, 0, kWrite);
    ASSERT_TRUE(run_until_pending(1));
    EXPECT_EQ(bus1.held[0].request.station, 0);
    EXPECT_FALSE(bus1.held[0].request.request.is_read());
    bus1.answer(0, kWritten);
    EXPECT_EQ(client.receive(), (modbus::Adu{1, 0, kWritten}));
    EXPECT_TRUE(bus2.seen.empty()) << "a line of another listener";
}

TEST_F(SessionBroadcast, RefusesAnythingButAWriteToUnitZero) {
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(0, read_pdu(0)), "83 01"_hex);
    EXPECT_EQ(client.ask(0, "16 0000 0000 0000"_hex), "96 01"_hex);
    EXPECT_EQ(client.ask(0, "17 0000 0001 0000 0001 02 0001"_hex), "97 01"_hex);
    EXPECT_EQ(client.ask(0, "06 0000"_hex), "86 03"_hex);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(SessionBroadcast, WaitsForTheLastOfSeveralLines) {
    settings.lines = {"floor1", "floor2"};
    start();
    Client client = connect();
    client.request(1, 0, kWrite);
    ASSERT_TRUE(run_until([&] { return bus1.held.size() + bus2.held.size() == 2; }));
    bus2.answer(0, kWritten);
    context.restart();
    context.poll();
    EXPECT_FALSE(client.has_input());
    bus1.answer(0, Fault::line_down, false);
    EXPECT_EQ(client.receive()->pdu, kWritten) << "a line that is down stops nobody";
}

TEST_F(SessionBroadcast, ReportsThatNoLineCouldTransmitABroadcast) {
    settings.lines = {"floor1", "floor2"};
    for (const BroadcastMode mode : {BroadcastMode::reply, BroadcastMode::silent}) {
        settings.broadcast = mode;
        start();
        Client client = connect();
        client.request(1, 0, kWrite);
        ASSERT_TRUE(run_until([&] { return bus1.held.size() + bus2.held.size() == 2; }));
        bus1.answer(0, Fault::line_down, false);
        bus2.answer(0, Fault::line_down, false);
        EXPECT_EQ(client.receive()->pdu, "90 0a"_hex);
    }
}

TEST_F(SessionBroadcast, ReportsThatABroadcastMayHaveBeenSent) {
    settings.lines = {"floor1", "floor2"};
    start();
    Client client = connect();
    client.request(1, 0, kWrite);
    ASSERT_TRUE(run_until([&] { return bus1.held.size() + bus2.held.size() == 2; }));
    bus1.answer(0, Fault::line_down, false);
    bus2.answer(0, Fault::line_lost, true);
    EXPECT_EQ(client.receive()->pdu, "90 0b"_hex);
}

TEST_F(SessionBroadcast, KeepsSilentWhenItIsAskedTo) {
    settings.broadcast = BroadcastMode::silent;
    settings.in_flight = 2;
    start();
    Client client = connect();
    client.request(1, 0, kWrite);
    client.request(2, 1, read_pdu(2));
    ASSERT_TRUE(run_until_pending(2));
    bus1.answer(1, reply_to_read(2));
    bus1.answer(0, kWritten);
    EXPECT_EQ(client.receive(), (modbus::Adu{2, 1, reply_to_read(2)}));
    EXPECT_EQ(client.ask(0, "06 0000"_hex), "86 03"_hex) << "what is known before is told";
    EXPECT_EQ(client.ask(0, read_pdu(0)), "83 01"_hex);
    client.request(3, 1, read_pdu(3));
    client.request(4, 1, read_pdu(4));
    EXPECT_TRUE(run_until_pending(2)) << "the silent one's place is free again";
}

TEST_F(SessionBroadcast, DeniesBroadcastsWhenItIsAskedTo) {
    settings.broadcast = BroadcastMode::deny;
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(0, kWrite), "90 01"_hex);
    EXPECT_TRUE(bus1.seen.empty());
}

TEST_F(SessionBroadcast, NeverWritesToAReadOnlyStationByBroadcast) {
    Settings wide = settings;
    wide.lines = {"a", "b"};
    const std::vector<LineInfo> lines{{"a", &bus1, {1}, true}, {"b", &bus2, {2}, true}};
    bus2.protect(2);
    const Decision both = decide(0, kWrite, wide, UnitMap(wide, lines));
    ASSERT_TRUE(std::holds_alternative<Refuse>(both));
    EXPECT_EQ(std::get<Refuse>(both).code, modbus::ExceptionCode::illegal_function);
    wide.lines = {"a"};
    EXPECT_TRUE(std::holds_alternative<Broadcast>(decide(0, kWrite, wide, UnitMap(wide, lines))));
}

TEST_F(SessionBroadcast, TreatsAMappedUnitZeroAsItsStation) {
    settings.units[0] = {"floor1", 1};
    start();
    Client client = connect();
    EXPECT_EQ(ask_bus(client, 0, read_pdu(1), reply_to_read(1)), reply_to_read(1));
    EXPECT_EQ(bus1.seen[0].station, 1);
}

}  // namespace
}  // namespace panelgate::tcp_server::session_broadcast_test
