#include "origin.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::host_names_test {
namespace {

using boost::asio::ip::make_address;

TEST(HostOfAuthority, IsTheNameWithoutItsTrimmings) {
    EXPECT_EQ(host_of_authority("gateway"), "gateway");
    EXPECT_EQ(host_of_authority("Gateway.Plant.Example:8080"), "gateway.plant.example");
    EXPECT_EQ(host_of_authority("gateway."), "gateway");
    EXPECT_EQ(host_of_authority("gateway.:80"), "gateway");
    EXPECT_EQ(host_of_authority("192.168.1.7:"), "192.168.1.7");
    EXPECT_EQ(host_of_authority("[FE80::1]:8080"), "fe80::1");
    EXPECT_EQ(host_of_authority("[::1]"), "::1");
}

TEST(HostOfAuthority, IsNothingOfWhatIsNone) {
    for (const char* text :
         {"", ":80", ".", "a b", "a/b", "a@b", "a:8o", "a:123456", "a:1:2", "::1", "[::1", "[::1]x",
          "[gateway]", "[]", "a\"b", "\xC3\xA4", "a%20b"}) {
        EXPECT_EQ(host_of_authority(text), std::nullopt) << text;
    }
}

class Names : public ::testing::Test {
  protected:
    bool knows(const char* host, const char* local = "192.168.1.7") const {
        return HostNames(settings, {"Box.plant.example", "box"}).knows(host, make_address(local));
    }
    Settings settings;
};

TEST_F(Names, AreThoseOfTheMachineUnlessOthersAreGiven) {
    EXPECT_TRUE(knows("box"));
    EXPECT_TRUE(knows("box.plant.example"));
    EXPECT_FALSE(knows("gateway.plant.example"));
    settings.hosts = {"Gateway.plant.example"};
    EXPECT_TRUE(knows("gateway.plant.example"));
    EXPECT_FALSE(knows("box"));
    EXPECT_FALSE(knows("plant.example"));
    EXPECT_FALSE(knows("evil.gateway.plant.example"));
}

TEST_F(Names, AreAlwaysTheAddressesThatLeadHere) {
    settings.address = "0.0.0.0";
    settings.hosts = {"gateway", "172.16.0.9"};
    EXPECT_TRUE(knows("192.168.1.7"));
    EXPECT_TRUE(knows("192.168.1.7", "::ffff:192.168.1.7"));
    EXPECT_TRUE(knows("fe80::7", "fe80::7%1"));
    EXPECT_TRUE(knows("fe80:0:0::7", "fe80::7"));
    EXPECT_TRUE(knows("172.16.0.9"));
    EXPECT_FALSE(knows("192.168.1.8"));
    EXPECT_FALSE(knows("fe80::8", "fe80::7"));
    settings.address = "10.0.0.1";
    EXPECT_TRUE(knows("10.0.0.1"));
}

TEST_F(Names, AreAlwaysTheLoopback) {
    settings.hosts = {"gateway"};
    for (const char* host : {"localhost", "127.0.0.1", "127.0.0.5", "::1", "::ffff:127.0.0.1"}) {
        EXPECT_TRUE(knows(host)) << host;
    }
    EXPECT_FALSE(knows("localhost.evil.example"));
}

TEST(MachineNames, AreFoundWithoutANameServer) {
    for (const std::string& name : machine_names()) EXPECT_TRUE(host_of_authority(name)) << name;
}

}  // namespace
}  // namespace panelgate::web::host_names_test
