#include "panelgate/base/who.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::who_test {
namespace {

TEST(Who, AnIpv4ClientOfAnIpv6ListenerIsIpv4) {
    const WhoRef mapped = make_who({.face = Face::http, .address = "::ffff:10.0.0.7"});
    const WhoRef plain = make_who({.face = Face::modbus_tcp, .address = "10.0.0.7"});
    EXPECT_EQ(mapped->address, "10.0.0.7");
    EXPECT_EQ(mapped->host, plain->host) << "both take the turns of one address";
    EXPECT_EQ(make_who({.address = "::ffff:1:2"})->address, "::ffff:1:2") << "is no IPv4 address";
    EXPECT_NE(make_who({.address = "10.0.0.8"})->host, plain->host);
    EXPECT_EQ(make_who({.address = "2001:db8::1"})->host,
              make_who({.address = "2001:db8::2"})->host)
        << "an IPv6 network of 64 bits is one host";
}

TEST(Who, WithoutAnAddressKeepsItsHost) {
    EXPECT_EQ(make_who({.face = Face::http})->host, 0u);
    EXPECT_EQ(make_who({.face = Face::serial_master, .host = 7})->host, 7u);
    const WhoRef task = own_task("poll of press");
    EXPECT_EQ(task->face, Face::gateway);
    EXPECT_EQ(text_of(task), "poll of press");
    EXPECT_EQ(text_of(nullptr), "a client without a name");
}

TEST(Who, RolesAreOrderedFromLeastToMost) {
    std::string all;
    for (const Role role : {Role::none, Role::viewer, Role::operator_, Role::engineer, Role::admin})
        all += std::string(label(role)) + ' ';
    EXPECT_EQ(all, "none viewer operator engineer admin ");
    EXPECT_LT(Role::viewer, Role::operator_);
    EXPECT_LT(Role::engineer, Role::admin);
}

}  // namespace
}  // namespace panelgate::who_test
