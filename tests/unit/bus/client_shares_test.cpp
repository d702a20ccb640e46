#include "client_shares.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::bus {
namespace {

constexpr TimePoint kNow{1h};

TEST(ClientShares, TheGreediestComesFirstWithItsName) {
    arbiter::BusShares used;
    used.add(7, 1s);
    used.add(8, 2s);
    used.add(8, 1s);
    arbiter::ClientNames names;
    names.set(7, "http 10.0.0.7");
    const std::vector<ClientShare> shares = client_shares(used, names, {}, kNow);
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
    EXPECT_TRUE(client_shares({}, names, {}, kNow).empty());
}

TEST(ClientShares, WhereNoTimeWasUsedNobodyHasAShareOfIt) {
    arbiter::BusShares used;
    used.add(7, Duration::zero());
    const std::vector<ClientShare> shares = client_shares(used, {}, {}, kNow);
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
    const std::vector<ClientShare> shares = client_shares(used, names, {}, kNow);
    ASSERT_EQ(shares.size(), 100u);
    EXPECT_EQ(shares.front().name, "client 200");
    EXPECT_EQ(shares.back().name, "client 101");
    EXPECT_NEAR(shares.front().percent, 100.0 * 200 / 20100, 1e-9);
}

TEST(ClientShares, TellWhatAClientAskedAndHowItLastFailed) {
    ClientAccounts accounts;
    accounts.answered(7, Outcome::timeout, kNow);  // of one that has gone
    for (int i = 0; i < 3; ++i) accounts.asked(7);
    accounts.answered(7, Outcome::ok, kNow);
    accounts.answered(7, Outcome::busy, kNow - 3s);
    accounts.answered(7, Outcome::cached, kNow);
    const std::vector<ClientShare> shares = client_shares({}, {}, accounts, kNow);
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares[0].requests, 3u);
    EXPECT_EQ(shares[0].failed, 1u);
    EXPECT_EQ(shares[0].last_error, Outcome::busy);
    EXPECT_EQ(shares[0].last_error_ago, 3s);
    accounts.forget(7);
    EXPECT_TRUE(client_shares({}, {}, accounts, kNow).empty());
}

TEST(ClientShares, OfMoreClientsThanThereIsRoomForTheFirstAreCounted) {
    ClientAccounts accounts;
    for (ClientId client = 1; client <= 2 * ClientAccounts::kClients; ++client)
        accounts.asked(client);
    EXPECT_EQ(accounts.all().size(), ClientAccounts::kClients);
}

TEST(ClientShares, AnAddressIsInTheNameOfAServersClient) {
    EXPECT_EQ(address_in("modbus_tcp 10.0.0.7:51234"), "10.0.0.7");
    EXPECT_EQ(address_in("modbus_tcp [::1]:51234"), "::1");
    EXPECT_EQ(address_in("http 10.0.0.9 token ops"), "10.0.0.9");
    EXPECT_EQ(address_in("http fe80::1 token ops"), "fe80::1");
    EXPECT_EQ(address_in("poll of station 31"), std::nullopt);
    EXPECT_EQ(address_in("http"), std::nullopt);
    EXPECT_EQ(address_in("relay press/UW0 to oven/GDT1"), std::nullopt);
}

}  // namespace
}  // namespace panelgate::bus
