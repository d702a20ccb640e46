#include "accounts.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::bus::client_shares_test {
namespace {

constexpr TimePoint kNow{1h};

std::vector<ClientShare> shares_of(const arbiter::BusShares& used,
                                   const arbiter::ClientNames& names,
                                   const ClientAccounts& accounts) {
    DepartedClients none;
    return client_shares({used, names, accounts, none}, kNow);
}

TEST(ClientShares, TheGreediestComesFirstWithItsName) {
    arbiter::BusShares used;
    used.add(7, 1s);
    used.add(8, 2s);
    used.add(8, 1s);
    arbiter::ClientNames names;
    names.set(7, "http 10.0.0.7");
    const std::vector<ClientShare> shares = shares_of(used, names, {});
    ASSERT_EQ(shares.size(), 2u);
    EXPECT_EQ(shares[0].name, "a client without a name");
    EXPECT_EQ(shares[0].busy, Duration(3s));
    EXPECT_EQ(shares[0].transactions, 2u);
    EXPECT_EQ(shares[0].percent, 75);
    EXPECT_EQ(shares[1].name, "http 10.0.0.7");
    EXPECT_EQ(shares[1].percent, 25);
}

TEST(ClientShares, WhoIsNamedAndHasAskedForNothingIsNotShown) {
    arbiter::ClientNames names;
    names.set(7, "idle");
    EXPECT_TRUE(shares_of({}, names, {}).empty());
}

TEST(ClientShares, WhereNoTimeWasUsedNobodyHasAShareOfIt) {
    arbiter::BusShares used;
    used.add(7, Duration::zero());
    const std::vector<ClientShare> shares = shares_of(used, {}, {});
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares[0].percent, 0);
}

TEST(ClientShares, OfMoreThanAHundredTheGreediestAreShownWithTheirShareOfAll) {
    arbiter::BusShares used;
    arbiter::ClientNames names;
    for (ClientId client = 1; client <= 200; ++client) {
        used.add(client, client * Duration(1ms));
        names.set(client, "client " + std::to_string(client));
    }
    const std::vector<ClientShare> shares = shares_of(used, names, {});
    ASSERT_EQ(shares.size(), 101u);
    EXPECT_EQ(shares.front().name, "client 200");
    EXPECT_EQ(shares[99].name, "client 101");
    EXPECT_EQ(shares.back().name, kOtherClients);
    EXPECT_EQ(shares.back().transactions, 100u);
    EXPECT_NEAR(shares.back().percent, 100.0 * 5050 / 20100, 1e-9);
    EXPECT_NEAR(shares.front().percent, 100.0 * 200 / 20100, 1e-9);
}

TEST(ClientShares, TellWhatAClientAskedAndHowItLastFailed) {
    ClientAccounts accounts;
    accounts.count_outcome(7, Outcome::timeout, kNow);  // for a departed client
    for (int i = 0; i < 3; ++i) accounts.count_request(7);
    accounts.count_outcome(7, Outcome::ok, kNow);
    accounts.count_outcome(7, Outcome::busy, kNow - 3s);
    accounts.count_outcome(7, Outcome::cached, kNow);
    const std::vector<ClientShare> shares = shares_of({}, {}, accounts);
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares[0].requests, 3u);
    EXPECT_EQ(shares[0].failed, 1u);
    EXPECT_EQ(shares[0].last_error, Outcome::busy);
    EXPECT_EQ(shares[0].last_error_ago, 3s);
    accounts.forget(7);
    EXPECT_TRUE(shares_of({}, {}, accounts).empty());
}

TEST(ClientShares, OfMoreClientsThanThereIsRoomForTheFirstAreCounted) {
    ClientAccounts accounts;
    for (ClientId client = 1; client <= 2 * ClientAccounts::kClients; ++client)
        accounts.count_request(client);
    EXPECT_EQ(accounts.all().size(), ClientAccounts::kClients);
}

TEST(ClientShares, WhatNobodyOfThemHasUsedIsTheOthers) {
    arbiter::BusShares used;
    used.add(7, 1s);
    arbiter::ClientNames names;
    names.set(7, "poll of press");
    DepartedClients departed;
    departed.leave(kNow - 1s, "http 10.0.0.9 token ops", {2s, 4},
                   {5, 1, Outcome::timeout, kNow - 3s});
    departed.leave(kNow, "relay a to b", {1s, 1}, {});
    const ClientAccounts accounts;
    const auto shares = client_shares({used, names, accounts, departed, 10s}, kNow);
    ASSERT_EQ(shares.size(), 3u);
    EXPECT_EQ(shares[0].name, "http 10.0.0.9 token ops");
    EXPECT_EQ(shares[0].gone, Duration(1s));
    EXPECT_EQ(shares[0].percent, 20);
    EXPECT_EQ(shares[0].last_error_ago, 3s);
    EXPECT_EQ(shares[1].percent, 10);
    EXPECT_EQ(shares[2].name, kOtherClients);
    EXPECT_EQ(shares[2].percent, 70) << "of whom is not shown, and the gateway's own";
}

TEST(ClientShares, WhoIsBackIsThere) {
    arbiter::BusShares used;
    used.add(7, 1s);
    arbiter::ClientNames names;
    names.set(7, "http 10.0.0.9");
    DepartedClients departed;
    departed.leave(kNow - 1s, "http 10.0.0.9", {2s, 4}, {5, 0, {}, {}});
    const ClientAccounts accounts;
    const auto shares = client_shares({used, names, accounts, departed, 3s}, kNow);
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_FALSE(shares[0].gone);
    EXPECT_EQ(shares[0].busy, Duration(3s));
    EXPECT_EQ(shares[0].requests, 5u);
}

TEST(DepartedClients, AreOneForAllPortsOfAnAddress) {
    DepartedClients departed;
    departed.leave(kNow - 2s, "modbus_tcp 10.0.0.7:5000", {1s, 1}, {1, 0, {}, {}});
    departed.leave(kNow - 1s, "modbus_tcp 10.0.0.7:5001", {1s, 1}, {1, 0, {}, {}});
    ASSERT_EQ(departed.rows(kNow).size(), 1u);
    const auto& [name, row] = *departed.rows(kNow).begin();
    EXPECT_EQ(name, "modbus_tcp 10.0.0.7");
    EXPECT_EQ(row.used.transactions, 2u);
    EXPECT_EQ(row.left, kNow - 1s);
}

TEST(DepartedClients, AreBoundedInTimeAndNumberAndNothingIsLost) {
    DepartedClients departed(ClientSettings{.remembered_for = 5min, .remembered = 2});
    for (int i = 1; i <= 3; ++i)
        departed.leave(kNow + i * 1min, "http 10.0.0." + std::to_string(i), {1s, 1},
                       {1, 0, {}, {}});
    EXPECT_EQ(departed.rows(kNow + 3min).size(), 2u);
    EXPECT_FALSE(departed.rows(kNow + 3min).contains("http 10.0.0.1")) << "it left first";
    EXPECT_EQ(departed.forgotten().used.busy, Duration(1s));
    EXPECT_TRUE(departed.rows(kNow + 1h).empty());
    EXPECT_EQ(departed.forgotten().used.busy, Duration(3s));
    EXPECT_EQ(departed.forgotten().totals.requests, 3u);
}

TEST(ClientShares, NamesOfServersClientsLoseTheirPorts) {
    EXPECT_EQ(without_port("modbus_tcp [2001:db8::1]:51234"), "modbus_tcp 2001:db8::1");
    EXPECT_EQ(without_port("http ::1 token ops"), "http ::1 token ops");
    EXPECT_EQ(without_port("poll of press"), "poll of press");
}

TEST(ClientShares, AnAddressIsInTheNameOfAServersClient) {
    EXPECT_EQ(address_in("modbus_tcp 10.0.0.7:51234"), "10.0.0.7");
    EXPECT_EQ(address_in("modbus_tcp [::1]:51234"), "::1");
    EXPECT_EQ(address_in("http 10.0.0.9 token ops"), "10.0.0.9");
    EXPECT_EQ(address_in("http fe80::1 token ops"), "fe80::1");
    EXPECT_EQ(address_in("poll of press"), std::nullopt);
    EXPECT_EQ(address_in("http"), std::nullopt);
    EXPECT_EQ(address_in("relay press/UW0 to oven/GDT1"), std::nullopt);
}

}  // namespace
}  // namespace panelgate::bus::client_shares_test
