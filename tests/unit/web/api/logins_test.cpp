#include <list>
#include <string>

#include "http_rig.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::web::logins_test {
namespace {

class LoginAttempts : public HttpRig {
  protected:
    LoginAttempts() {
        settings.anonymous = Role::none;
        settings.tokens.push_back({"ops", Role::operator_, "right"});
        settings.logins.free = 2;
        settings.logins.hold = 1ms;
        start();
    }
    unsigned status(const std::string& token, const char* target = "/api/v1/lines") {
        return ask("GET", target, "", "Authorization: Bearer " + token + "\r\n").status();
    }
};

TEST_F(LoginAttempts, AreCountedAndLoggedWhenTheyFail) {
    const rt::LogTap log;
    EXPECT_EQ(status("right"), 200u);
    EXPECT_EQ(status("wrong"), 401u);
    EXPECT_EQ(get("/api/v1/lines").status(), 401u);       // no token was sent
    EXPECT_EQ(status("wrong", "/healthz"), 200u);         // the token is not checked
    EXPECT_EQ(status("wrong", "/api/v1/nothing"), 404u);  // the token is not checked
    EXPECT_EQ(ask("GET", "/api/v1/lines", "", "Authorization: Basic b3BzOnJpZ2h0\r\n").status(),
              401u)
        << "no token, no guess";
    EXPECT_EQ(server->counters().login_failures, 1u);
    EXPECT_EQ(server->counters().requests.at(401), 3u);
    EXPECT_EQ(server->counters().requests.at(200), 2u);
    EXPECT_EQ(log.count("login failed"), 1u);
    EXPECT_EQ(log.count("client=127.0.0.1"), 1u);
    EXPECT_EQ(log.count("wrong"), 0u);
}

TEST_F(LoginAttempts, OfAnAddressThatGuessesAreHeldUpAndThenJudged) {
    for (int i = 0; i < 6; ++i) EXPECT_EQ(status("wrong"), 401u);
    EXPECT_EQ(status("right"), 200u);
    EXPECT_EQ(server->counters().login_failures, 6u);
}

TEST_F(LoginAttempts, ThatAreRightAreAnsweredAtOnceWhereWrongOnesAreHeld) {
    settings.logins.hold = 1h;
    start();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status("wrong"), 401u);
    Client guessing = connect();
    guessing.send("GET /api/v1/lines HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer wrong\r\n\r\n");
    while (server->counters().login_failures < 4) io.run_one();
    now += 1h;  // another turn
    EXPECT_EQ(status("right"), 200u);
    EXPECT_EQ(server->counters().requests.at(401), 3u) << "the fourth wrong one waits";
    server.reset();
}

TEST_F(LoginAttempts, ThatAreHeldTakeNoPlaceFromThoseThatAreRight) {
    settings.logins.hold = 1h;
    settings.max_connections_per_address = 3;
    start();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status("wrong"), 401u);
    std::list<Client> guessing;
    for (unsigned i = 1; i <= settings.max_connections_per_address; ++i) {
        guessing.push_back(connect());
        guessing.back().send(
            "GET /api/v1/lines HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer wrong\r\n\r\n");
        while (server->counters().login_failures < 3 + i) io.run_one();
        now += 1h;  // another turn
    }
    EXPECT_EQ(status("right"), 200u);
    EXPECT_EQ(server->connections(), settings.max_connections_per_address + 1)
        << "they go on waiting";
    server.reset();
}

TEST_F(LoginAttempts, ThatWereHeldEndTheirConnection) {
    Client guessing = connect();
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(
            guessing.ask("GET", "/api/v1/lines", "", "Authorization: Bearer wrong\r\n").status(),
            401u);
    }
    const Reply last = guessing.ask("GET", "/api/v1/lines", "", "Authorization: Bearer wrong\r\n");
    EXPECT_EQ(last.status(), 401u);
    EXPECT_EQ(last.header("Connection"), "close");
}

TEST_F(LoginAttempts, OfAnAddressThatGuessesAreHeldAlsoWhereAllPlacesAreTaken) {
    settings.logins.hold = 1h;
    settings.max_connections_per_address = 1;
    settings.anonymous = Role::viewer;
    start();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status("wrong"), 401u);
    Client asking = connect();
    bus.script = [](const bus::Request&) { return std::nullopt; };
    asking.send("GET /api/v1/stations/press/holding-registers/1 HTTP/1.1\r\nHost: x\r\n\r\n");
    while (bus.open() == 0) io.run_one();
    Client refused = connect();
    refused.send("GET /api/v1/lines HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer wrong\r\n\r\n");
    while (server->connections() < 2) io.run_one();
    io.poll();
    EXPECT_FALSE(server->counters().requests.contains(503)) << "it would come again at once";
    EXPECT_EQ(get("/healthz").status(), 200u);
    server.reset();
}

TEST_F(LoginAttempts, MayBeGivenUpWhileTheyAreHeld) {
    settings.logins.hold = 1h;
    start();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status("wrong"), 401u);
    Client client = connect();
    client.send("GET /api/v1/lines HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer wrong\r\n\r\n");
    while (server->connections() == 0) io.run_one();
    io.poll();
    server.reset();
    EXPECT_TRUE(client.receive().error);
}

TEST_F(LoginAttempts, FromWhereNobodyMayAreClosedWithoutAByte) {
    settings.allow = {{"192.0.2.0", 24}};
    start();
    const rt::LogTap log;
    Client client = connect();
    EXPECT_TRUE(client.receive().error);
    EXPECT_EQ(server->connections(), 0u);
    EXPECT_EQ(log.count("not in the allow list"), 1u);
}

}  // namespace
}  // namespace panelgate::web::logins_test
