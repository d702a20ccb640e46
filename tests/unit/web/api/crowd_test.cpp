#include <list>
#include <string>

#include "http_rig.hpp"

namespace panelgate::web::crowd_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRead = "/api/v1/stations/press/holding-registers/1";

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
        bus.script = [](const bus::Request&) { return std::nullopt; };
        for (std::size_t i = 0; i < settings.max_connections_per_address; ++i) {
            come(1);
            crowd.back().send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n");
            while (bus.open() == i) io.run_one();
        }
    }
    std::list<Client> crowd;
};

TEST_F(Crowd, OfIdleConnectionsKeepsNobodyOut) {
    come(40);
    EXPECT_EQ(get("/healthz").status(), 200u);
    EXPECT_EQ(get("/api/v1/stations").status(), 200u);
    EXPECT_EQ(get(kRead).status(), 200u);
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
    client.send(
        "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: x\r\nContent-Length: 14\r\n\r\n"
        "{\"values\":[1]}GET / HTTP/1.1\r\nHost: x\r\n\r\n");  // the rest stays unread
    const Reply reply = client.receive();
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
    EXPECT_EQ(reply.header("Retry-After"), "1");
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_THAT(reply.at("detail").as_string().c_str(), HasSubstr("places"));
    client.socket().shutdown(tcp::socket::shutdown_send);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
    EXPECT_EQ(bus.open(), settings.max_connections_per_address);
}

TEST_F(Crowd, EndsAConnectionThatNeverAsks) {
    settings.first_request_timeout = 1ms;
    Client client = connect();
    EXPECT_TRUE(client.receive().error);
    EXPECT_EQ(server->connections(), 0u);
}

}  // namespace
}  // namespace panelgate::web::crowd_test
