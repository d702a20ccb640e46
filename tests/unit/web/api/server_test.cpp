#include "panelgate/web/api/server.hpp"

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "http_rig.hpp"
#include "panelgate/web/http/gzip.hpp"

namespace panelgate::web::server_test {
namespace {

using ::testing::HasSubstr;
using WebServer = HttpRig;

constexpr const char* kRead = "/api/v1/stations/press/holding-registers/1";
std::string read_text() { return http_text("GET", kRead); }

/// A client that closes its sending side behind this text.
void send_and_close(Client& client, const std::string& text) {
    client.send(text);
    client.socket().shutdown(tcp::socket::shutdown_send);
}

TEST_F(WebServer, AnswersProbesMetricsAndTheIndex) {
    EXPECT_EQ(get("/healthz").body(), "ok\n");
    EXPECT_EQ(get("/readyz").status(), 200u);
    ready = false;
    EXPECT_EQ(get("/readyz").status(), 503u);
    missing = "modbus_tcp 192.0.2.7:502 (late)";
    EXPECT_EQ(get("/readyz").body(), "not ready: modbus_tcp 192.0.2.7:502 (late)\n");
    const Reply text = get("/metrics");
    EXPECT_EQ(text.body(), "up 1\n");
    EXPECT_EQ(text.header("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
    EXPECT_EQ(text.header("Server"), "panelgate/1.2.3");
    EXPECT_THAT(get("/").body(), HasSubstr("/api/v1/stations"));
}

TEST_F(WebServer, KeepsAConnectionAndAnswersPipelinedRequestsInOrder) {
    Client client = connect();
    client.send(read_text() + http_text("GET", "/healthz") + http_text("GET", "/readyz"));
    EXPECT_EQ(client.receive().at("values"), json_of("[1]"));
    EXPECT_EQ(client.receive().body(), "ok\n");
    EXPECT_EQ(client.receive().body(), "ready\n");
    const Reply head = client.ask("HEAD", "/healthz");
    EXPECT_EQ(head.status(), 200u);
    EXPECT_EQ(head.header("Content-Length"), "3");
    EXPECT_EQ(server->connections(), 1u);
    const Reply last = client.ask("GET", "/healthz", "", "Connection: close\r\n");
    EXPECT_EQ(last.body(), "ok\n");
    EXPECT_EQ(last.header("Connection"), "close");
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, UnderstandsARequestThatArrivesByteByByteAndABodyThatWaits) {
    Client client = connect();
    for (const char c : put_coil_text()) {
        client.send(std::string(1, c));
        io.poll();
    }
    EXPECT_EQ(client.receive().status(), 200u);
    client.send(http_text("PUT", "/api/v1/stations/press/coils/1",
                          "Expect: 100-continue\r\nContent-Length: 14\r\n"));
    EXPECT_EQ(client.receive().status(), 100u);
    client.send("{\"values\":[1]}");
    EXPECT_EQ(client.receive().status(), 200u);
}

TEST_F(WebServer, RefusesWhatIsTooLargeAndWhatIsNotHttp) {
    settings.max_body = 100;
    const Reply reply = ask("PUT", "/api/v1/stations/press/coils/1", std::string(101, ' '));
    EXPECT_EQ(reply.status(), 413u);
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_EQ(reply.at("detail"), "a body has at most 100 bytes");
    Client chunked = connect();
    chunked.send(http_text("PUT", "/", "Transfer-Encoding: chunked\r\n") + "80\r\n" +
                 std::string(128, ' ') + "\r\n0\r\n\r\n");
    EXPECT_EQ(chunked.receive().status(), 413u);
    EXPECT_EQ(ask("GET", "/healthz", "", "X: " + std::string(20'000, 'x') + "\r\n").status(), 431u);
    Client client = connect();
    client.send("\x01\x03 modbus?\r\n\r\n");
    EXPECT_EQ(client.receive().status(), 400u);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, EndsAConnectionThatKeepsItWaiting) {
    struct Row {
        Duration Settings::* patience;
        std::string text;
    };
    const Row rows[] = {{&Settings::first_request_timeout, ""},
                        {&Settings::request_timeout, "GET /healthz HTTP/1.1\r\nHost:"},
                        {&Settings::idle_timeout, http_text("GET", "/healthz")}};
    const Settings usual = settings;
    for (const Row& row : rows) {
        settings = usual;
        settings.*row.patience = 1ms;
        start();
        Client client = connect();
        client.send(row.text);
        if (row.patience == &Settings::idle_timeout) {
            EXPECT_EQ(client.receive().status(), 200u);
        }
        EXPECT_TRUE(client.receive().error) << row.text;
        EXPECT_EQ(server->connections(), 0u) << row.text;
    }
}

TEST_F(WebServer, P2ForgetsTheRequestsOfAClientThatGoesAway) {
    settings.half_close_grace = 1ms;
    hold_answers();
    ask_and_leave(read_text());
    while (server->connections() > 0) io.run_one();
    EXPECT_EQ(bus.open(), 0u);
    ASSERT_EQ(bus.cancelled.size(), 1u);
    EXPECT_EQ(bus.cancelled[0], bus.requests[0].client);
}

TEST_F(WebServer, P2ForgetsTheRequestsOfAClientThatIsReset) {
    settings.half_close_grace = 1h;
    hold_answers();
    Client client = connect();
    begin(client, read_text() + read_text());  // unread input hides nothing
    client.socket().set_option(boost::asio::socket_base::linger(true, 0));
    client.socket().close();
    while (server->connections() > 0) io.run_one();
    EXPECT_EQ(bus.open(), 0u);
}

TEST_F(WebServer, P3AnswersAClientThatHasClosedItsSendingSide) {
    hold_answers();
    Client client = connect();
    send_and_close(client, put_coil_text() + put_coil_text());
    for (std::size_t i = 0; i < 2; ++i) {
        while (bus.open() == 0) io.run_one();
        while (io.poll_one() > 0) {
        }
        ASSERT_EQ(bus.open(), 1u);
        bus.release(answer_from_addresses(bus.requests[i]));
        EXPECT_EQ(client.receive().status(), 200u);
    }
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, TellsAClientThatClosesItsSendingSideTooEarly) {
    Client client = connect();
    send_and_close(client, "GET /healthz HTTP/1.1\r\nHost: x\r\n");
    EXPECT_EQ(client.receive().status(), 400u);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, P3AsksAClientThatHasClosedItsSendingSideWhetherItIsStillThere) {
    settings.half_close_grace = 1ms;
    hold_answers();
    Client client = connect();
    send_and_close(client, read_text());
    EXPECT_EQ(client.receive().status(), 100u);
    EXPECT_EQ(client.receive().status(), 100u);
    EXPECT_EQ(bus.open(), 1u);
    bus.release(answer_from_addresses(bus.requests[0]));
    Reply reply = client.receive();
    while (reply.status() == 100) reply = client.receive();
    EXPECT_EQ(reply.status(), 200u);
}

TEST_F(WebServer, AsksAListenerThatHasClosedItsSendingSideWhetherItIsStillThere) {
    settings.half_close_grace = 1ms;
    const std::string listen = http_text("GET", "/api/v1/events");
    Client stays = connect();
    send_and_close(stays, listen);
    {
        Client leaves = connect();
        leaves.send(listen);
        while (events.is_idle()) io.run_one();
        io.poll();
        EXPECT_EQ(server->connections(), 2u);
    }
    while (server->connections() > 1) io.run_one();
    EXPECT_FALSE(events.is_idle());
}

TEST_F(WebServer, P9GivesEverySessionItsOwnClientIdAndTellsTheBusesItsAddress) {
    Client first = connect();
    Client second = connect();
    for (Client* client : {&first, &second, &first})
        EXPECT_EQ(client->ask("GET", kRead).status(), 200u);
    EXPECT_EQ(second.ask("PUT", kRead, R"({"values":[1]})").status(), 200u);
    ASSERT_EQ(bus.requests.size(), 4u);
    EXPECT_NE(bus.requests[0].client, bus.requests[1].client);
    EXPECT_EQ(bus.requests[0].client, bus.requests[2].client);
    for (const bus::Request& request : bus.requests) EXPECT_EQ(request.who->address, "127.0.0.1");
}

TEST_F(WebServer, P3AnswersARunningRequestBeforeItStops) {
    hold_answers();
    Client idle = connect();
    Client client = connect();
    begin(client, read_text());
    server->stop();
    EXPECT_TRUE(idle.receive().error);
    EXPECT_EQ(server->connections(), 1u);
    bus.release(answer_from_addresses(bus.requests[0]));
    const Reply reply = client.receive();
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
    EXPECT_EQ(server->connections(), 0u);
}

TEST_F(WebServer, WaitsForNoClientThatDoesNotReadWhenItStops) {
    settings.request_timeout = 1h;
    metrics = std::string(std::size_t{16} * 1024 * 1024, 'x');
    Client client = connect();
    for (int i = 0; i < 3; ++i) client.send(http_text("GET", "/metrics"));
    while (server->counters().requests.empty()) io.run_one();
    io.poll();
    server->stop(1ms);
    io.run_for(30s);  // nothing is left to do long before
    EXPECT_EQ(server->connections(), 0u);
    io.restart();
}

TEST_F(WebServer, TakesNobodyElseAfterItStopped) {
    start();
    const std::uint16_t port = server->port();
    EXPECT_NE(port, 0);
    server->stop();
    io.poll();
    EXPECT_THROW(Client(io, port), boost::system::system_error);
    io.restart();
}

TEST_F(WebServer, MayBeDestroyedWithARequestOnTheBusAndWithoutEverRunning) {
    start();
    server.reset();
    hold_answers();
    Client client = connect();
    begin(client, read_text());
    server.reset();
    EXPECT_EQ(bus.open(), 0u);
    EXPECT_TRUE(client.receive().error);
}

TEST_F(WebServer, SaysWhyItCannotListen) {
    start();
    Settings same = settings;
    same.port = server->port();
    Server second(io.get_executor(), same, shown(), Providers{});
    EXPECT_EQ(second.start(), boost::system::errc::address_in_use);
    EXPECT_EQ(second.port(), 0);
    same.address = "nowhere";
    Server third(io.get_executor(), same, shown(), Providers{});
    EXPECT_TRUE(third.start());
}

TEST_F(WebServer, AnswersAHandlerThatThrowsWith500) {
    Providers providers;
    providers.ready = []() -> bool { throw std::runtime_error("no"); };
    providers.missing = [] { return std::string(); };
    server = std::make_unique<Server>(io.get_executor(), settings, shown(), providers);
    ASSERT_FALSE(server->start());
    Client client = connect();
    EXPECT_EQ(client.ask("GET", "/readyz").status(), 500u);
    EXPECT_EQ(client.ask("GET", "/healthz").status(), 200u);
}

TEST_F(WebServer, SendsMetricsInTheCodingThatTheClientTakes) {
    metrics = std::string(5000, 'x');
    const Reply packed = ask("GET", "/metrics", "", "Accept-Encoding: br, gzip\r\n");
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    EXPECT_EQ(packed.header("Vary"), "Accept-Encoding");
    const Reply plain = get("/metrics");
    EXPECT_EQ(plain.header("Content-Encoding"), "");
    EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
    EXPECT_EQ(unpacked(packed.body()), plain.body());
}

TEST_F(WebServer, SendsALongBodyWholeAndItsHeadAlone) {
    metrics = std::string(5'000'000, 'x');
    Client client = connect();
    EXPECT_EQ(client.ask("GET", "/metrics").body().size(), 5'000'000u);
    const Reply head = client.ask("HEAD", "/metrics");
    EXPECT_EQ(head.status(), 200u);
    EXPECT_EQ(head.header("Content-Length"), "5000000");
}

TEST_F(WebServer, BoundsTheBytesOfBodiesThatAreBeingSent) {
    settings.max_sending = 24 * 1024 * 1024;
    metrics = std::string(std::size_t{16} * 1024 * 1024, 'x');
    Client slow = connect();
    slow.send(http_text("GET", "/metrics"));
    while (server->counters().requests.empty()) io.run_one();
    const Reply reply = get("/metrics");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Retry-After"), "1");
    EXPECT_EQ(slow.receive().body().size(), metrics.size());
    EXPECT_EQ(get("/metrics").status(), 200u) << "what was sent counts no more";
}

}  // namespace
}  // namespace panelgate::web::server_test
