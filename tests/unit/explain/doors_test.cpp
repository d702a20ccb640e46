#include "panelgate/explain/doors.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::explain::doors_test {
namespace {

config::Config plant() {
    config::Config config;
    config.http.emplace();
    config.http->anonymous = Role::viewer;
    config.http->tokens = {{.name = "ops", .standing = Role::operator_, .hash = "one"}};
    config.modbus_tcp.emplace_back();
    config::Line floor1;
    floor1.name = "floor1";
    floor1.stations.resize(1);
    floor1.stations[0].id = 7;
    config.lines = {floor1};
    config.lines.push_back(floor1);
    config.lines.back().name = "floor2";
    config.lines.back().stations[0].id = 8;
    return config;
}

WhoRef with_token() {
    return make_who({.face = Face::http, .token = "ops", .standing = Role::operator_});
}

class DoorsTest : public testing::Test {
  protected:
    DoorsTest() { doors.open(std::make_shared<const config::Config>(before)); }
    /// What he meets who came in before this change: "" nothing, what keeps him out, or his role.
    template <class Change>
    std::string after(const WhoRef& who, Change change) {
        config::Config now = before;
        change(now);
        doors.change(std::make_shared<const config::Config>(now));
        const auto met = doors.admit(who, "floor1", station, at);
        doors.settle();
        doors.open(std::make_shared<const config::Config>(before));
        if (!met) return "";
        EXPECT_FALSE(met->may.has(Right::broadcast));
        return std::string(met->rule.empty() ? met->who->standing.name() : met->rule) +
               (met->may.has(Right::read) ? " r" : "") + (met->may.has(Right::write) ? "w" : "");
    }

    config::Config before = plant();
    std::uint8_t station = 7;  ///< that is asked, on floor1
    Doors doors;
    WallTime at{};
};

TEST_F(DoorsTest, ATokenIsWhatItIsNow) {
    EXPECT_EQ(after(with_token(), [](auto&) {}), "");
    const auto change = [&](auto how) {
        return after(with_token(), [&](config::Config& now) { how(now.http->tokens[0]); });
    };
    EXPECT_EQ(change([](web::Token& token) { token.standing = Role::viewer; }), "viewer r");
    EXPECT_EQ(change([](web::Token& token) { token.hash = "two"; }), "token");
    EXPECT_EQ(change([](web::Token& token) { token.name = "other"; }), "token");
    EXPECT_EQ(change([&](web::Token& token) { token.expires = at; }), "token");
    EXPECT_EQ(change([&](web::Token& token) { token.expires = at + 1s; }), "");
    OwnRole blind{.name = "blind"};
    blind.rights.add(Right::write);
    EXPECT_EQ(change([&](web::Token& token) { token.standing = {Role::operator_, blind}; }),
              "blindw");
    EXPECT_EQ(after(with_token(), [](config::Config& now) { now.http.reset(); }), "")
        << "a listener that is gone answers what it has taken in";
}

TEST_F(DoorsTest, ANewTextIsNewOnlyToThoseWhoHaveShownTheOldOne) {
    config::Config now = before;
    now.http->tokens[0].hash = "two";
    doors.change(std::make_shared<const config::Config>(now));
    EXPECT_TRUE(doors.admit(with_token(), "floor1", 7, at).has_value());
    doors.settle();
    EXPECT_FALSE(doors.admit(with_token(), "floor1", 7, at).has_value());
}

TEST_F(DoorsTest, ClientsWithoutATokenAreWhatAnonymousIsNow) {
    const WhoRef who = make_who({.face = Face::http, .standing = Role::viewer});
    EXPECT_EQ(after(who, [](auto&) {}), "");
    EXPECT_EQ(after(who, [](config::Config& now) { now.http->anonymous = Role::none; }), "none");
}

TEST_F(DoorsTest, ACertificateIsWhatItsRoleIsNow) {
    before.http->tls.emplace();
    before.http->tls->role_from_certificate = true;
    doors.open(std::make_shared<const config::Config>(before));
    const WhoRef who = make_who({.face = Face::http,
                                 .standing = Role::operator_,
                                 .certificate = "CN=panel",
                                 .certificate_role = "operator"});
    EXPECT_EQ(after(who, [](auto&) {}), "");
    const auto by_token = [](config::Config& now) { now.http->tls->role_from_certificate = false; };
    EXPECT_EQ(after(who, by_token), "viewer r");
    Who other = *who;
    other.certificate_role = "nobody";
    EXPECT_EQ(after(make_who(other), [](auto&) {}), "viewer r") << "no role is called that now";
}

TEST_F(DoorsTest, AModbusClientMeetsItsListenersNewDoor) {
    const WhoRef who = make_who({.face = Face::modbus_tcp,
                                 .address = "10.0.0.7",
                                 .listener = before.modbus_tcp[0].name(),
                                 .standing = Role::operator_});
    const auto change = [&](auto how) {
        return after(who, [&](config::Config& now) { how(now.modbus_tcp[0]); });
    };
    using tcp_server::BroadcastMode;
    EXPECT_EQ(change([](auto&) {}), "");
    EXPECT_EQ(change([](auto& one) { one.read_only = true; }), "access r");
    EXPECT_EQ(change([](auto& one) { one.broadcast = BroadcastMode::deny; }), "access rw");
    EXPECT_EQ(change([](auto& one) { one.allow = {{"10.0.1.0", 24}}; }), "allow");
    EXPECT_EQ(change([](auto& one) { one.allow = {{"10.0.0.0", 24}}; }), "");
    EXPECT_EQ(change([](auto& one) { one.lines = {"floor1"}; }), "");
    EXPECT_EQ(change([](auto& one) { one.lines = {"floor2"}; }), "access");
}

TEST_F(DoorsTest, AnUnlistedStationWaitsNoLongerThanItIsPassedOn) {
    before.modbus_tcp[0].lines = {"floor1"};
    doors.open(std::make_shared<const config::Config>(before));
    const WhoRef who = make_who({.face = Face::modbus_tcp,
                                 .listener = before.modbus_tcp[0].name(),
                                 .standing = Role::operator_});
    station = 77;
    EXPECT_EQ(after(who, [](auto&) {}), "");
    EXPECT_EQ(after(who, [](config::Config& now) { now.lines[0].refuse_unlisted = true; }),
              "access");
    station = 7;
    EXPECT_EQ(after(who, [](config::Config& now) { now.lines[0].refuse_unlisted = true; }), "");
}

TEST_F(DoorsTest, WhereAListenerLeadsIsWhereItsUnitsGo) {
    tcp_server::Settings listener;
    listener.lines = {"floor1"};
    const auto leads = [&](const char* line, std::uint8_t to,
                           Unlisted unlisted = Unlisted::as_the_line) {
        return leads_to(destinations_of(listener, before, unlisted), line, to);
    };
    EXPECT_TRUE(leads("floor1", 0));
    EXPECT_TRUE(leads("floor1", 77)) << "a line of its own";
    EXPECT_FALSE(leads("floor1", 77, Unlisted::refused)) << "a serial master's";
    EXPECT_FALSE(leads("floor2", 8));
    before.lines[0].refuse_unlisted = true;
    EXPECT_TRUE(leads("floor1", 7));
    EXPECT_FALSE(leads("floor1", 77));
    listener.units[50] = {"floor2", 9};
    EXPECT_TRUE(leads("floor2", 9));
    EXPECT_FALSE(leads("floor2", 0)) << "an alias is no line";
    listener.lines.clear();
    EXPECT_TRUE(leads("floor2", 8));
    EXPECT_FALSE(leads("floor2", 77)) << "which of two lines?";
    before.lines[1].stations[0].id = 7;
    EXPECT_FALSE(leads("floor2", 7)) << "which of two lines?";
    listener.units[0] = {"floor2", 0};
    EXPECT_TRUE(leads("floor2", 0));
    EXPECT_FALSE(leads("floor1", 0)) << "unit 0 is an alias";
}

TEST_F(DoorsTest, TheGatewayItselfAndNobodyAreNotAsked) {
    EXPECT_FALSE(doors.admit(own_task("poll"), "floor1", 7, at).has_value());
    EXPECT_FALSE(doors.admit(nullptr, "floor1", 7, at).has_value());
    EXPECT_FALSE(Doors().admit(with_token(), "floor1", 7, at).has_value());
}

}  // namespace
}  // namespace panelgate::explain::doors_test
