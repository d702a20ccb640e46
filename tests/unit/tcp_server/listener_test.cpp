#include "panelgate/tcp_server/listener.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <system_error>
#include <vector>

#include "loopback.hpp"
#include "places.hpp"

namespace panelgate::tcp_server::listener_test {
namespace {

using ::testing::HasSubstr;

class ListenerTest : public Loopback {
  protected:
    Client connect_from_elsewhere() { return connect("127.0.0.2"); }
    void expect_places(std::uint64_t evicted, std::uint64_t refused) {
        EXPECT_EQ(counters().evicted, evicted);
        EXPECT_EQ(counters().refused, refused);
    }
};

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
    {
        Client first = connect();
        Client second = connect();
        ASSERT_TRUE(run_until_connections(2));
    }
    ASSERT_TRUE(run_until_connections(0));
    EXPECT_EQ(counters().connections_total, 2U);
    EXPECT_EQ(counters().protocol_errors, 0U);
    EXPECT_EQ(counters().listener, "127.0.0.1:0");
}

TEST_F(ListenerTest, ClosesAPeerThatIsNotAllowedAndLetsAnAllowedOneIn) {
    settings.allow = {{"10.0.0.0", 8}, {"127.0.0.1", 32}};
    bus1.instant = reply_to_read(1);
    Client stranger = connect_from_elsewhere();
    EXPECT_TRUE(stranger.sees_close());
    EXPECT_EQ(counters().connections_total, 1U);
    EXPECT_EQ(counters().connections, 0U);
    EXPECT_EQ(log.count("allow list"), 1U);
    Client client = connect();
    EXPECT_TRUE(is_served(client));
}

TEST_F(ListenerTest, P9PassesTheClientAndItsAddressToTheBuses) {
    bus1.rights = {};
    Client first = connect();
    Client second = connect();
    Client other = connect_from_elsewhere();
    read(first, 1, 1);
    second.request(1, 0, "06 0000 0001"_hex);
    ASSERT_TRUE(run_until_pending(2));
    read(other, 1, 3);
    EXPECT_EQ(bus1.seen[0].who->address, "127.0.0.1");
    EXPECT_EQ(bus1.seen[1].who->host, bus1.seen[0].who->host);
    EXPECT_EQ(bus1.seen[2].who->address, "127.0.0.2");
    EXPECT_NE(bus1.seen[2].who->host, bus1.seen[0].who->host);
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
    EXPECT_TRUE(is_served(client));
    EXPECT_EQ(bus1.seen[0].who->address, "127.0.0.1");
}

TEST_F(ListenerTest, RefusesTheNewestWhenItIsFullAndNoneIsIdle) {
    settings.max_connections = 2;
    Client first = connect();
    Client second = connect();
    first.read(1);
    second.read(1);
    ASSERT_TRUE(run_until_pending(2));
    Client third = connect();
    Client fourth = connect();
    EXPECT_TRUE(third.sees_close());
    EXPECT_TRUE(fourth.sees_close());
    EXPECT_EQ(log.count("max_connections reached"), 1U) << "told once";
    expect_places(0, 2);
}

TEST_F(ListenerTest, TakesNewOnesWhenOneHasLeftAFullHouse) {
    settings.max_connections = 1;
    bus1.instant = reply_to_read(1);
    std::optional<Client> first(connect());
    EXPECT_TRUE(is_served(*first));
    first.reset();
    ASSERT_TRUE(run_until_connections(0));
    Client second = connect();
    EXPECT_TRUE(is_served(second));
    expect_places(0, 0);
}

TEST_F(ListenerTest, P9AnAddressThatLeaksConnectionsLosesItsLongestIdleOneAndLocksOutNoOther) {
    settings.max_connections = 6;
    settings.max_connections_per_address = 3;
    bus1.instant = reply_to_read(1);
    const auto ask_and_rest = [&](Client& client) {
        EXPECT_TRUE(is_served(client));
        clock.advance(1s);
    };
    Client first = connect();
    ask_and_rest(first);
    Client second = connect();
    ask_and_rest(second);
    ask_and_rest(first);
    Client third = connect();
    ask_and_rest(third);
    Client fourth = connect();
    EXPECT_TRUE(second.sees_close()) << "it has asked nothing for longest";
    for (Client* one : {&first, &third, &fourth}) EXPECT_TRUE(is_served(*one));
    expect_places(1, 0);
    EXPECT_EQ(counters().connections, 3U) << "others have their places";
}

TEST_F(ListenerTest, P9HalfSentRequestsOfOneAddressDoNotLockOutAnother) {
    settings.max_connections = 2;
    bus1.instant = reply_to_read(1);
    Client first = connect();
    first.send("0001 0000 0006 01"_hex);
    ASSERT_TRUE(run_until_armed(1));
    clock.advance(1s);
    Client second = connect();
    second.send("0001 0000 0006 01"_hex);
    ASSERT_TRUE(run_until_armed(2));
    Client other = connect_from_elsewhere();
    EXPECT_TRUE(is_served(other));
    EXPECT_TRUE(first.sees_close()) << "it has sent nothing for longest";
    EXPECT_EQ(counters().connections, 2U);
    expect_places(1, 0);
    EXPECT_EQ(log.count("warn connection gives way"), 1U);
}

TEST_F(ListenerTest, P9AHalfSentRequestThatDoesNotGoOnIsIdle) {
    settings.max_connections_per_address = 1;
    bus1.instant = reply_to_read(1);
    Client first = connect();
    first.send("0001 0000 0006 01"_hex);
    ASSERT_TRUE(run_until_armed());
    Client second = connect();
    EXPECT_TRUE(second.sees_close()) << "the first may go on";
    clock.advance(settings.half_sent_pause);
    Client third = connect();
    EXPECT_TRUE(is_served(third));
    EXPECT_TRUE(first.sees_close());
    EXPECT_EQ(log.count("info connection gives way"), 1U);
}

TEST_F(ListenerTest, P9BusyConnectionsOfOneAddressDoNotLockOutAnother) {
    settings.max_connections = 2;
    Client first = connect();
    read(first, 1, 1);
    clock.advance(1s);
    Client second = connect();
    read(second, 2, 2);
    Client other = connect_from_elsewhere();
    EXPECT_TRUE(first.sees_close()) << "its request is the oldest";
    EXPECT_EQ(bus1.cancelled.size(), 1U) << "what it had waiting goes with it";
    read(other, 3, 2);
    bus1.answer(1, reply_to_read(3));
    EXPECT_EQ(other.receive(), read_reply(3));
    Client third = connect();
    EXPECT_TRUE(third.sees_close()) << "its address has half of the places";
    expect_places(1, 1);
}

TEST_F(ListenerTest, P9AConnectionWithSomethingOpenGivesNoWayToItsOwnAddress) {
    settings.max_connections_per_address = 2;
    Client first = connect();
    Client second = connect();
    first.read(1);
    second.read(2);
    ASSERT_TRUE(run_until_pending(2));
    Client third = connect();
    EXPECT_TRUE(third.sees_close());
    expect_places(0, 1);
    EXPECT_EQ(log.count("max_connections_per_address reached"), 1U);
}

TEST_F(ListenerTest, TakesThreeHundredClientsAtOnce) {
    settings.max_connections_per_address = 300;
    bus1.instant = reply_to_read(1);
    std::list<Client> clients;
    for (int i = 0; i < 300; ++i) clients.push_back(connect());
    for (Client& client : clients) client.read(1);
    for (Client& client : clients) EXPECT_EQ(client.receive(), read_reply(1));
    EXPECT_EQ(counters().connections, 300U);
}

TEST_F(ListenerTest, AnswersWhatIsOutstandingBeforeItStops) {
    Client idle = connect();
    Client busy = connect();
    read(busy, 1, 1);
    stop();
    EXPECT_TRUE(idle.sees_close());
    busy.read(2);
    do_all_that_is_due();
    EXPECT_FALSE(stopped);
    EXPECT_EQ(bus1.seen.size(), 1U) << "no new requests";
    bus1.answer(0, reply_to_read(1));
    EXPECT_EQ(busy.receive(), read_reply(1));
    EXPECT_TRUE(busy.sees_close());
    EXPECT_TRUE(run_until_stopped());
    EXPECT_THROW(connect(), boost::system::system_error);
}

TEST_F(ListenerTest, StopsAsynchronouslyAlsoWithoutConnectionsOrWhenTheyAreCut) {
    for (const bool connected : {false, true}) {
        start();
        std::optional<Client> client;
        if (connected) read(client.emplace(connect()), 1, 1);
        stopped = false;
        stop();
        EXPECT_FALSE(stopped);
        if (connected) {
            listener->close_now();
            EXPECT_EQ(bus1.cancelled.size(), 1U);
            EXPECT_TRUE(client->sees_close());
        }
        EXPECT_TRUE(run_until_stopped());
    }
}

TEST_F(ListenerTest, MayEndWhileRequestsAreOutstanding) {
    Client client = connect();
    read(client, 1, 1);
    const bus::AnswerHandler late = bus1.held[0].handler;
    listener.reset();
    do_all_that_is_due();
    late(bus::Answer{});
    EXPECT_TRUE(client.sees_close());
}

TEST_F(ListenerTest, RestsWhileThereAreNoDescriptors) {
    bus1.instant = reply_to_read(1);
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
    EXPECT_TRUE(is_served(client));
    EXPECT_EQ(log.count("warn cannot accept listener=127.0.0.1:0 reason=\"Too many open files\""),
              1U);
}

using Guests = std::vector<Guest>;

/// Heard in this second.
Guest idle(std::uint64_t host, int second) { return {host, true, TimePoint(1h) + 1s * second}; }
Guest busy(std::uint64_t host, int second) { return {host, false, TimePoint(1h) + 1s * second}; }

struct PlaceCase {
    const char* why;
    Guests guests;
    std::uint64_t newcomer;
    std::optional<std::size_t> gives_way;
    PlaceLimits limits = {4, 4};
};

void expect_gives_way(const std::vector<PlaceCase>& cases) {
    for (const auto& [why, guests, newcomer, gives_way, limits] : cases) {
        const Place place = find_place(guests, newcomer, limits);
        EXPECT_EQ(place.taken_from, gives_way) << why;
        EXPECT_EQ(place.found, place.taken_from || guests.size() < limits.in_all) << why;
    }
}

TEST(Places, P9AnAddressReplacesItsOwnIdleConnectionsAndThoseOfTheAddressWithMost) {
    expect_gives_way({
        {"an empty house", {}, 1, {}},
        {"a free place", {busy(1, 1), idle(1, 2), idle(2, 3)}, 1, {}},
        {"one may have them all", {busy(1, 1), idle(1, 3), idle(1, 2), idle(1, 4)}, 1, 2U},
        {"longest idle of the most", {idle(2, 1), busy(1, 2), idle(1, 4), idle(1, 3)}, 3, 3U},
        {"two with most", {busy(2, 1), idle(2, 4), busy(1, 2), idle(1, 3)}, 3, 3U},
        {"its share is used", {idle(2, 1), idle(1, 2), busy(1, 3)}, 1, 1U, {4, 2}},
    });
    const Place place = find_place(Guests{idle(2, 1), busy(1, 2), busy(1, 3)}, 1, {4, 2});
    EXPECT_FALSE(place.found) << "it takes none of another";
    EXPECT_TRUE(place.share_used);
    EXPECT_EQ(place.own, 2U);
}

TEST(Places, P9AnAddressWithoutAConnectionFindsAPlaceHoweverBusyTheOthersAre) {
    expect_gives_way({
        {"all busy", {busy(1, 3), busy(1, 1), busy(1, 2), busy(1, 4)}, 2, 1U},
        {"not another's idle one", {busy(1, 3), busy(1, 2), busy(1, 4), idle(2, 1)}, 3, 1U},
        {"the only one", {busy(1, 1)}, 2, 0U, {1, 1}},
        {"with two less", {busy(1, 1), busy(1, 2), busy(1, 3), busy(2, 4)}, 2, 0U},
        {"with the same", {busy(1, 1), busy(1, 2), busy(2, 3), busy(2, 4)}, 2, {}},
        {"it would be taken back", {busy(1, 1), busy(1, 2), busy(2, 3)}, 2, {}, {3, 3}},
    });
}

}  // namespace
}  // namespace panelgate::tcp_server::listener_test
