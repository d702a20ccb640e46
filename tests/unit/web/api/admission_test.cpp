// Who gets a place and an answer: crowds, guessers of tokens, foreign names.
#include <cstddef>
#include <iterator>
#include <list>
#include <string>

#include "http_rig.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::web::admission_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRead = "/api/v1/stations/press/holding-registers/1";
constexpr const char* kWrong = "Authorization: Bearer wrong\r\n";

/// A server with six connections, three per address, and two more for probes.
class Crowd : public HttpRig {
  protected:
    Crowd() {
        settings.max_connections = 6;
        settings.max_connections_per_address = 3;
        settings.probe_places = 2;
    }
    /// Connections without a request.
    void come(std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            crowd.push_back(connect());
            io.poll();
        }
    }
    /// Fills all connections of the address with unanswered requests.
    void keep_busy() {
        hold_answers();
        for (std::size_t i = 0; i < settings.max_connections_per_address; ++i) {
            come(1);
            begin(crowd.back(), http_text("GET", kRead));
        }
    }
    std::list<Client> crowd;
};

TEST_F(Crowd, OfIdleConnectionsKeepsNobodyOut) {
    come(40);
    for (const char* path : {"/healthz", "/api/v1/stations", kRead})
        EXPECT_EQ(get(path).status(), 200u) << path;
    EXPECT_LE(server->connections(), settings.max_connections_per_address);
}

TEST_F(Crowd, LosesWhoHasBeenIdleForLongest) {
    come(3);
    EXPECT_EQ(crowd.front().ask("GET", "/healthz").status(), 200u);
    come(1);
    EXPECT_EQ(crowd.front().ask("GET", "/healthz").status(), 200u);
    EXPECT_EQ(std::next(crowd.begin())->receive().error, http::error::end_of_stream);
}

TEST_F(Crowd, WithAllPlacesBusyLeavesProbesTheirAnswer) {
    keep_busy();
    EXPECT_EQ(get("/healthz").status(), 200u);
    EXPECT_EQ(get("/readyz").status(), 200u);
    come(40);
    EXPECT_EQ(get("/healthz").body(), "ok\n");
    EXPECT_EQ(bus.open(), settings.max_connections_per_address);
}

TEST_F(Crowd, WithAllPlacesBusyRefusesTheOthersInWords) {
    keep_busy();
    Client client = connect();
    client.send(put_coil_text() + http_text("GET", "/"));  // the rest stays unread
    const Reply reply = client.receive();
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
    EXPECT_EQ(reply.header("Retry-After"), "1");
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_THAT(detail_of(reply), HasSubstr("places"));
    client.socket().shutdown(tcp::socket::shutdown_send);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
    EXPECT_EQ(bus.open(), settings.max_connections_per_address);
}

class LoginAttempts : public HttpRig {
  protected:
    LoginAttempts() {
        settings.anonymous = Role::none;
        settings.tokens.push_back({"ops", Role::operator_, hash_of("right")});
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

TEST_F(LoginAttempts, BeyondTenWrongOnesAMinuteAreNotJudgedUntilItIsOver) {
    for (int i = 0; i < 10; ++i) EXPECT_EQ(status("wrong"), 401u);
    EXPECT_EQ(status("right"), 200u);
    now += 20s;
    const Reply refused = ask("GET", "/api/v1/lines", "", kWrong);
    EXPECT_EQ(refused.status(), 429u);
    EXPECT_EQ(refused.header("Retry-After"), "40");
    EXPECT_THAT(refused.body(), HasSubstr("urn:panelgate:problem:too-many-requests"));
    EXPECT_EQ(status("right"), 429u) << "what is not judged tells nothing";
    EXPECT_EQ(status("right", "/healthz"), 200u);
    EXPECT_EQ(get("/api/v1/lines").status(), 401u) << "without a token there is nothing to guess";
    EXPECT_EQ(server->counters().login_failures, 11u);
    now += 40s;
    EXPECT_EQ(status("right"), 200u);
    EXPECT_EQ(status("wrong"), 401u) << "another minute";
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

/// Whole requests, as a browser or a script sends them.
class Hosts : public HttpRig {
  protected:
    Reply say(const std::string& text) {
        Client client = connect();
        client.send(text + "\r\n");
        return client.receive();
    }
};

TEST_F(Hosts, OfOthersAreMisdirected) {
    const std::string body = "Content-Length: 14\r\n\r\n{\"values\":[1]}";
    const std::string write = "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: ";
    Client client = connect();
    client.send(write +
                "evil.example:8080\r\nOrigin: http://evil.example:8080\r\n"
                "Content-Type: application/json\r\n" +
                body);
    EXPECT_EQ(status_and(client.receive(), "title"), "421 Misdirected Request");
    EXPECT_TRUE(bus.requests.empty());
    client.send(write + "X.:8080\r\n" + body);
    EXPECT_EQ(client.receive().status(), 200u);
}

TEST_F(Hosts, StandInARequestOnceAndAreOursButForProbes) {
    struct Row {
        const char* text;
        unsigned status;
    };
    constexpr Row kRows[] = {
        {"GET /nothing HTTP/1.1\r\nHost: evil\r\n", 421},
        {"GET / HTTP/1.1\r\nHost: 127.0.0.1:1\r\n", 200},
        {"GET / HTTP/1.0\r\nHost: evil\r\n", 421},
        {"GET / HTTP/1.1\r\n", 400},
        {"GET / HTTP/1.1\r\nHost:\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: x\r\nHost: x\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: x y\r\n", 400},
        {"GET / HTTP/1.0\r\n", 200},
        // the host of an absolute target counts
        {"GET http://x:8080/api/v1/lines HTTP/1.1\r\nHost: evil\r\n", 200},
        {"GET http://evil/api/v1/lines HTTP/1.1\r\nHost: x\r\n", 421},
        {"GET http://x/ HTTP/1.1\r\n", 400},
        // probes are answered under any name and with any query
        {"GET /healthz HTTP/1.1\r\nHost: pod.cluster\r\n", 200},
        {"GET /readyz HTTP/1.0\r\n", 200},
        {"GET /healthz HTTP/1.1\r\n", 200},
        {"GET /healthz HTTP/1.1\r\nHost: x\r\nHost: x\r\n", 400},
        {"GET /healthz?x=1 HTTP/1.1\r\nHost: x\r\n", 200},
        {"GET /readyz?x=1&x=2 HTTP/1.1\r\nHost: x\r\n", 200},
    };
    for (const Row& row : kRows) EXPECT_EQ(say(row.text).status(), row.status) << row.text;
}

TEST_F(Hosts, NeverHearTheirBytesRaw) {
    const Reply reply = get("/api/v1/stations/%C3%28");
    EXPECT_EQ(reply.status(), 400u);
    EXPECT_EQ(reply.body().find('\xC3'), std::string::npos);
}

}  // namespace
}  // namespace panelgate::web::admission_test
