#include "panelgate/tcp_server/listener.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <list>
#include <system_error>

#include "loopback.hpp"

namespace panelgate::tcp_server::listener_test {
namespace {

using ::testing::HasSubstr;

class ListenerTest : public Loopback {};

TEST_F(ListenerTest, ReportsTheAddressItCannotBind) {
    start();
    settings.port = listener->port();
    Listener second(context.get_executor(), clock, settings, UnitMap(settings, lines), {});
    try {
        second.start();
        FAIL() << "two listeners on one port";
    } catch (const std::system_error& error) {
        EXPECT_EQ(error.code(), std::errc::address_in_use);
        EXPECT_THAT(error.what(), HasSubstr(settings.name()));
    }
    EXPECT_EQ(second.port(), 0);
    settings.address = "floor1";
    Listener third(context.get_executor(), clock, settings, UnitMap(settings, lines), {});
    EXPECT_THROW(third.start(), std::system_error);
}

TEST_F(ListenerTest, CountsItsConnections) {
    start();
    {
        Client first = connect();
        Client second = connect();
        ASSERT_TRUE(run_until([&] { return listener->counters().connections == 2; }));
    }
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    EXPECT_EQ(listener->counters().connections_total, 2U);
    EXPECT_EQ(listener->counters().protocol_errors, 0U);
    EXPECT_EQ(listener->counters().listener, "127.0.0.1:0");
}

TEST_F(ListenerTest, ClosesAPeerThatIsNotAllowed) {
    settings.allow = {{"10.0.0.0", 8}};
    start();
    Client client = connect();
    EXPECT_TRUE(client.sees_close());
    EXPECT_EQ(listener->counters().connections_total, 1U);
    EXPECT_EQ(listener->counters().connections, 0U);
    EXPECT_EQ(log.count("allow list"), 1U);
}

TEST_F(ListenerTest, LetsAnAllowedPeerIn) {
    settings.allow = {{"10.0.0.0", 8}, {"127.0.0.0", 8}};
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();
    EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1));
}

TEST_F(ListenerTest, P9PassesTheClientAndItsAddressToTheBuses) {
    bus1.rights = {};
    start();
    Client first = connect();
    Client second = connect();
    Client other(context, listener->port(), 0, "127.0.0.2");
    first.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(1));
    second.request(1, 0, "06 0000 0001"_hex);
    ASSERT_TRUE(run_until_pending(2));
    other.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(3));
    EXPECT_EQ(bus1.seen[0].host, bus::host_of("127.0.0.1"));
    EXPECT_EQ(bus1.seen[1].host, bus1.seen[0].host);
    EXPECT_EQ(bus1.seen[2].host, bus::host_of("127.0.0.2"));
    EXPECT_NE(bus1.seen[2].host, bus1.seen[0].host);
    EXPECT_THAT(bus1.names[bus1.seen[0].client], HasSubstr("modbus_tcp 127.0.0.1:"));
    EXPECT_THAT(bus1.names[bus1.seen[1].client], HasSubstr("modbus_tcp 127.0.0.1:"))
        << "a broadcast is somebody's too";
}

TEST_F(ListenerTest, P9TakesIpv4ForTheSameAddressOnAnIpv6Listener) {
    settings.address = "::";
    bus1.instant = reply_to_read(1);
    try {
        start();
    } catch (const std::system_error&) {
        GTEST_SKIP() << "no IPv6 here";
    }
    Client client = connect();
    EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(bus1.seen[0].host, bus::host_of("127.0.0.1"));
}

TEST_F(ListenerTest, RefusesTheNewestWhenItIsFullAndNoneIsIdle) {
    settings.max_connections = 2;
    start();
    Client first = connect();
    Client second = connect();
    first.request(1, 1, read_pdu(1));
    second.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until([&] { return bus1.seen.size() == 2; }));
    Client third = connect();
    Client fourth = connect();
    EXPECT_TRUE(third.sees_close());
    EXPECT_TRUE(fourth.sees_close());
    EXPECT_EQ(log.count("max_connections reached"), 1U) << "told once";
    EXPECT_EQ(listener->counters().refused, 2U);
}

TEST_F(ListenerTest, TakesNewOnesWhenOneHasLeftAFullHouse) {
    settings.max_connections = 1;
    bus1.instant = reply_to_read(1);
    start();
    std::optional<Client> first(connect());
    EXPECT_EQ(first->ask(1, read_pdu(1)), reply_to_read(1));
    first.reset();
    ASSERT_TRUE(run_until([&] { return listener->counters().connections == 0; }));
    Client second = connect();
    EXPECT_EQ(second.ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(listener->counters().evicted, 0U);
}

TEST_F(ListenerTest, P9AnAddressThatLeaksConnectionsLosesItsLongestIdleOneAndLocksOutNoOther) {
    settings.max_connections = 6;
    settings.max_connections_per_address = 3;
    bus1.instant = reply_to_read(1);
    start();
    Client first = connect();
    EXPECT_EQ(first.ask(1, read_pdu(1)), reply_to_read(1));
    clock.advance(1s);
    Client second = connect();
    EXPECT_EQ(second.ask(1, read_pdu(1)), reply_to_read(1));
    clock.advance(1s);
    EXPECT_EQ(first.ask(1, read_pdu(1)), reply_to_read(1));
    clock.advance(1s);
    Client third = connect();
    EXPECT_EQ(third.ask(1, read_pdu(1)), reply_to_read(1));
    clock.advance(1s);
    Client fourth = connect();
    EXPECT_TRUE(second.sees_close()) << "it has asked nothing for longest";
    for (Client* one : {&first, &third, &fourth})
        EXPECT_EQ(one->ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(listener->counters().evicted, 1U);
    EXPECT_EQ(listener->counters().refused, 0U);
    EXPECT_EQ(listener->counters().connections, 3U) << "others have their places";
}

TEST_F(ListenerTest, P9AConnectionWithSomethingOpenNeverGivesWay) {
    settings.max_connections_per_address = 2;
    start();
    Client first = connect();
    Client second = connect();
    first.request(1, 1, read_pdu(1));
    second.request(2, 1, read_pdu(1));
    ASSERT_TRUE(run_until([&] { return bus1.seen.size() == 2; }));
    Client third = connect();
    EXPECT_TRUE(third.sees_close());
    EXPECT_EQ(listener->counters().refused, 1U);
    EXPECT_EQ(log.count("max_connections_per_address reached"), 1U);
}

TEST_F(ListenerTest, TakesThreeHundredClientsAtOnce) {
    settings.max_connections_per_address = 300;
    bus1.instant = reply_to_read(1);
    start();
    std::list<Client> clients;
    for (int i = 0; i < 300; ++i) clients.emplace_back(context, listener->port());
    for (Client& client : clients) client.request(1, 1, read_pdu(1));
    for (Client& client : clients) {
        EXPECT_EQ(client.receive(), (modbus::Adu{1, 1, reply_to_read(1)}));
    }
    EXPECT_EQ(listener->counters().connections, 300U);
}

TEST_F(ListenerTest, AnswersWhatIsOutstandingBeforeItStops) {
    start();
    Client idle = connect();
    Client busy = connect();
    busy.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(1));
    bool stopped = false;
    listener->stop([&] { stopped = true; });
    EXPECT_TRUE(idle.sees_close());
    busy.request(2, 1, read_pdu(2));
    context.restart();
    context.poll();
    EXPECT_FALSE(stopped);
    EXPECT_EQ(bus1.seen.size(), 1U) << "no new requests";
    bus1.answer(0, reply_to_read(1));
    EXPECT_EQ(busy.receive(), (modbus::Adu{1, 1, reply_to_read(1)}));
    EXPECT_TRUE(busy.sees_close());
    EXPECT_TRUE(run_until([&] { return stopped; }));
    EXPECT_THROW(connect(), boost::system::system_error);
}

TEST_F(ListenerTest, StopsAsynchronouslyWhenThereAreNoConnections) {
    start();
    bool stopped = false;
    listener->stop([&] { stopped = true; });
    EXPECT_FALSE(stopped);
    EXPECT_TRUE(run_until([&] { return stopped; }));
}

TEST_F(ListenerTest, CutsConnectionsOnRequest) {
    start();
    Client client = connect();
    client.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(1));
    bool stopped = false;
    listener->stop([&] { stopped = true; });
    listener->close_now();
    EXPECT_EQ(bus1.cancelled.size(), 1U);
    EXPECT_TRUE(client.sees_close());
    EXPECT_TRUE(run_until([&] { return stopped; }));
}

TEST_F(ListenerTest, MayEndWhileRequestsAreOutstanding) {
    start();
    Client client = connect();
    client.request(1, 1, read_pdu(1));
    ASSERT_TRUE(run_until_pending(1));
    const bus::AnswerHandler late = bus1.held[0].handler;
    listener.reset();
    context.restart();
    context.poll();
    late(bus::Answer{});
    EXPECT_TRUE(client.sees_close());
}

TEST_F(ListenerTest, RestsWhileThereAreNoDescriptors) {
    bus1.instant = reply_to_read(1);
    start();
    Client client = connect();  // in the backlog: the loop has not run yet
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    const int next = open("/dev/null", O_RDONLY | O_CLOEXEC);
    close(next);
    rlimit none = before;
    none.rlim_cur = static_cast<rlim_t>(next);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
    const bool told = run_until([&] { return log.count("cannot accept") == 1; });
    context.restart();
    const std::size_t turns = context.poll();
    setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_TRUE(told);
    EXPECT_LE(turns, 2U) << "it spins";
    EXPECT_EQ(client.ask(1, read_pdu(1)), reply_to_read(1));
    EXPECT_EQ(log.count("warn cannot accept listener=127.0.0.1:0 reason=\"Too many open files\""),
              1U);
}

}  // namespace
}  // namespace panelgate::tcp_server::listener_test
