#include "panelgate/arbiter/job.hpp"

#include <gtest/gtest.h>

namespace panelgate::arbiter::client_names_test {
namespace {

TEST(ClientNames, TheLastNameCountsUntilTheClientHasGone) {
    ClientNames names;
    EXPECT_EQ(names.of(7), "a client without a name");
    names.set(7, "http 10.0.0.9");
    names.set(7, "http 10.0.0.9 token ops");
    EXPECT_EQ(names.of(7), "http 10.0.0.9 token ops");
    names.forget(7);
    EXPECT_EQ(names.of(7), "a client without a name");
}

TEST(ClientNames, P9AreBoundedAndAKnownClientMayChangeItsName) {
    ClientNames names;
    for (Client client = 1; client <= ClientNames::kClients + 1; ++client) names.set(client, "x");
    EXPECT_EQ(names.of(ClientNames::kClients), "x");
    EXPECT_EQ(names.of(ClientNames::kClients + 1), "a client without a name");
    names.set(1, "y");
    EXPECT_EQ(names.of(1), "y");
}

}  // namespace
}  // namespace panelgate::arbiter::client_names_test
