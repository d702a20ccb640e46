#include "client_shares.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::bus {
namespace {

TEST(ClientShares, TheGreediestComesFirstWithItsName) {
    arbiter::BusShares used;
    used.add(7, 1s);
    used.add(8, 2s);
    used.add(8, 1s);
    arbiter::ClientNames names;
    names.set(7, "http 10.0.0.7");
    const std::vector<ClientShare> shares = client_shares(used, names);
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
    EXPECT_TRUE(client_shares({}, names).empty());
}

TEST(ClientShares, WhereNoTimeWasUsedNobodyHasAShareOfIt) {
    arbiter::BusShares used;
    used.add(7, Duration::zero());
    const std::vector<ClientShare> shares = client_shares(used, {});
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
    const std::vector<ClientShare> shares = client_shares(used, names);
    ASSERT_EQ(shares.size(), 100u);
    EXPECT_EQ(shares.front().name, "client 200");
    EXPECT_EQ(shares.back().name, "client 101");
    EXPECT_NEAR(shares.front().percent, 100.0 * 200 / 20100, 1e-9);
}

}  // namespace
}  // namespace panelgate::bus
