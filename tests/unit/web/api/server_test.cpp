#include <sys/socket.h>

#include "http_rig.hpp"

namespace panelgate::web::server_test {
namespace {

using ::testing::HasSubstr;
using WebServer = HttpRig;

constexpr const char* kRead = "/api/v1/stations/press/holding-registers/1";

TEST_F(WebServer, AnswersProbesMetricsAndTheIndex) {
    EXPECT_EQ(get("/healthz").body(), "ok\n");
    EXPECT_EQ(get("/readyz").status(), 200u);
    ready = false;
    EXPECT_EQ(get("/readyz").status(), 503u);
    missing = "modbus_tcp 192.0.2.7:502 (late)";
    EXPECT_EQ(get("/readyz").body(), "not ready: modbus_tcp 192.0.2.7:502 (late)\n");
    const Reply metrics = get("/metrics");
    EXPECT_EQ(metrics.body(), "up 1\n");
    EXPECT_EQ(metrics.header("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
    EXPECT_EQ(metrics.header("Server"), "panelgate/1.2.3");
    EXPECT_THAT(get("/").body(), HasSubstr("/api/v1/stations"));
}

TEST_F(WebServer, AnswersHeadWithTheLengthAndNoBody) {
    Client client = connect();
    const Reply head = client.ask("HEAD", "/healthz");
    EXPECT_EQ(head.status(), 200u);
    EXPECT_EQ(head.header("Content-Length"), "3");
    EXPECT_EQ(client.ask("GET", "/healthz").body(), "ok\n");
}

TEST_F(WebServer, KnowsWhatIsThereAndHowItMayBeAsked) {
    EXPECT_EQ(get("/nothing").status(), 404u);
    EXPECT_EQ(get("/api/v1/stations/press/coils").status(), 404u);
    EXPECT_EQ(get("/api/v1/stations/press/coils/1/2").status(), 404u);
    EXPECT_EQ(ask("POST", "/api/v1/stations").status(), 405u);
    EXPECT_EQ(ask("POST", "/api/v1/stations").header("Allow"), "GET, HEAD");
    EXPECT_EQ(ask("DELETE", "/api/v1/stations/press/coils/1").header("Allow"), "GET, HEAD, PUT");
    EXPECT_EQ(ask("GET", "/api/v1/lines/floor1/raw").header("Allow"), "POST");
    EXPECT_EQ(get("/%zz").status(), 400u);
    EXPECT_EQ(get("/api/v1/stations/").status(), 200u);
}

TEST_F(WebServer, KeepsAConnectionAndAnswersPipelinedRequestsInOrder) {
    Client client = connect();
    client.send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n" +
                "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\nGET /readyz HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_EQ(client.receive().at("values"), json_of("[1]"));
    EXPECT_EQ(client.receive().body(), "ok\n");
    EXPECT_EQ(client.receive().body(), "ready\n");
    EXPECT_EQ(server->connections(), 1u);
}

TEST_F(WebServer, UnderstandsARequestThatArrivesByteByByte) {
    Client client = connect();
    const std::string text =
        "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: x\r\nContent-Length: 14\r\n\r\n"
        "{\"values\":[1]}";
    for (const char c : text) {
        client.send(std::string(1, c));
        io.poll();
    }
    EXPECT_EQ(client.receive().status(), 200u);
}

TEST_F(WebServer, ClosesWhenTheClientAsksForIt) {
    Client client = connect();
    const Reply reply = client.ask("GET", "/healthz", "", "Connection: close\r\n");
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, InvitesABodyThatWaitsForIt) {
    Client client = connect();
    client.send(
        "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\n"
        "Content-Length: 14\r\n\r\n");
    EXPECT_EQ(client.receive().status(), 100u);
    client.send("{\"values\":[1]}");
    EXPECT_EQ(client.receive().status(), 200u);
}

TEST_F(WebServer, RefusesABodyThatIsTooLarge) {
    settings.max_body = 100;
    const Reply reply = ask("PUT", "/api/v1/stations/press/coils/1", std::string(101, ' '));
    EXPECT_EQ(reply.status(), 413u);
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_EQ(reply.at("detail"), "a body has at most 100 bytes");
    Client chunked = connect();
    chunked.send("PUT / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n80\r\n" +
                 std::string(128, ' ') + "\r\n0\r\n\r\n");
    EXPECT_EQ(chunked.receive().status(), 413u);
}

TEST_F(WebServer, RefusesAHeaderThatIsTooLargeAndWhatIsNotHttp) {
    EXPECT_EQ(ask("GET", "/healthz", "", "X: " + std::string(20'000, 'x') + "\r\n").status(), 431u);
    Client client = connect();
    client.send("\x01\x03 modbus?\r\n\r\n");
    EXPECT_EQ(client.receive().status(), 400u);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, EndsAConnectionThatIsIdleForTooLong) {
    settings.idle_timeout = 1ms;
    Client client = connect();
    EXPECT_EQ(client.ask("GET", "/healthz").status(), 200u);
    EXPECT_TRUE(client.receive().error);
    EXPECT_EQ(server->connections(), 0u);
}

TEST_F(WebServer, EndsAConnectionWhoseRequestNeverEnds) {
    settings.request_timeout = 1ms;
    Client client = connect();
    client.send("GET /healthz HTTP/1.1\r\nHost:");
    EXPECT_TRUE(client.receive().error);
    EXPECT_EQ(server->connections(), 0u);
}

TEST_F(WebServer, P2ForgetsTheRequestsOfAClientThatGoesAway) {
    settings.half_close_grace = 1ms;
    bus.script = [](const bus::Request&) { return std::nullopt; };
    {
        Client client = connect();
        client.send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n");
        while (bus.open() == 0) io.run_one();
    }
    while (server->connections() > 0) io.run_one();
    EXPECT_EQ(bus.open(), 0u);
    ASSERT_EQ(bus.cancelled.size(), 1u);
    EXPECT_EQ(bus.cancelled[0], bus.requests[0].client);
}

TEST_F(WebServer, P2ForgetsTheRequestsOfAClientThatIsReset) {
    settings.half_close_grace = 1h;
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client client = connect();
    const std::string ask = std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n";
    client.send(ask + ask);  // unread input hides nothing
    while (bus.open() == 0) io.run_one();
    client.socket().set_option(boost::asio::socket_base::linger(true, 0));
    client.socket().close();
    while (server->connections() > 0) io.run_one();
    EXPECT_EQ(bus.open(), 0u);
}

TEST_F(WebServer, P3AnswersAClientThatHasClosedItsSendingSide) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client client = connect();
    const std::string write =
        "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: x\r\n"
        "Content-Length: 14\r\n\r\n{\"values\":[1]}";
    client.send(write + write);
    client.socket().shutdown(tcp::socket::shutdown_send);
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
    client.send("GET /healthz HTTP/1.1\r\nHost: x\r\n");
    client.socket().shutdown(tcp::socket::shutdown_send);
    EXPECT_EQ(client.receive().status(), 400u);
    EXPECT_EQ(client.receive().error, http::error::end_of_stream);
}

TEST_F(WebServer, P3AsksAClientThatHasClosedItsSendingSideWhetherItIsStillThere) {
    settings.half_close_grace = 1ms;
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client client = connect();
    client.send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n");
    client.socket().shutdown(tcp::socket::shutdown_send);
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
    const std::string listen = "GET /api/v1/events HTTP/1.1\r\nHost: x\r\n\r\n";
    Client stays = connect();
    stays.send(listen);
    stays.socket().shutdown(tcp::socket::shutdown_send);
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

TEST_F(WebServer, GivesEverySessionItsOwnClientId) {
    Client first = connect();
    Client second = connect();
    for (Client* client : {&first, &second, &first}) {
        EXPECT_EQ(client->ask("GET", kRead).status(), 200u);
    }
    EXPECT_NE(bus.requests[0].client, bus.requests[1].client);
    EXPECT_EQ(bus.requests[0].client, bus.requests[2].client);
}

TEST_F(WebServer, P9TellsTheBusesFromWhichAddressASessionAsks) {
    EXPECT_EQ(get(kRead).status(), 200u);
    EXPECT_EQ(ask("PUT", kRead, R"({"values":[1]})").status(), 200u);
    ASSERT_EQ(bus.requests.size(), 2u);
    for (const bus::Request& request : bus.requests) {
        EXPECT_EQ(request.host, bus::host_of("127.0.0.1"));
    }
}

TEST_F(WebServer, P3AnswersARunningRequestBeforeItStops) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client idle = connect();
    Client client = connect();
    client.send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n");
    while (bus.open() == 0) io.run_one();
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
    metrics.text = std::make_shared<const std::string>(std::size_t{16} * 1024 * 1024, 'x');
    Client client = connect();
    for (int i = 0; i < 3; ++i) client.send("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
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

TEST_F(WebServer, MayBeDestroyedWithARequestOnTheBus) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client client = connect();
    client.send(std::string("GET ") + kRead + " HTTP/1.1\r\nHost: x\r\n\r\n");
    while (bus.open() == 0) io.run_one();
    server.reset();
    EXPECT_EQ(bus.open(), 0u);
    EXPECT_TRUE(client.receive().error);
}

TEST_F(WebServer, MayBeDestroyedWithoutEverRunning) {
    start();
    server.reset();
    start();
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
    const Reply packed = ask("GET", "/metrics", "", "Accept-Encoding: br, gzip\r\n");
    EXPECT_TRUE(metrics.asked_gzip);
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    EXPECT_EQ(packed.header("Vary"), "Accept-Encoding");
    const Reply plain = get("/metrics");
    EXPECT_FALSE(metrics.asked_gzip);
    EXPECT_EQ(plain.header("Content-Encoding"), "");
    EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
}

TEST_F(WebServer, SendsALongBodyWholeAndItsHeadAlone) {
    metrics.text = std::make_shared<const std::string>(5'000'000, 'x');
    Client client = connect();
    const Reply reply = client.ask("GET", "/metrics");
    EXPECT_EQ(reply.body().size(), 5'000'000u);
    const Reply head = client.ask("HEAD", "/metrics");
    EXPECT_EQ(head.status(), 200u);
    EXPECT_EQ(head.header("Content-Length"), "5000000");
    EXPECT_EQ(metrics.text.use_count(), 1) << "what was sent is kept by nobody";
}

TEST_F(WebServer, RefusesMetricsWhenTooManyAreUnderWay) {
    metrics.text = nullptr;
    const Reply reply = get("/metrics");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Retry-After"), "1");
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
}

TEST_F(WebServer, TellsTheMetricsOfACallerThatLeaves) {
    metrics.deferred = true;
    {
        Client client = connect();
        client.send("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
        while (metrics.waiting.empty()) io.run_one();
    }
    while (metrics.cancelled == 0) io.run_one();
    EXPECT_TRUE(metrics.waiting.empty());
    while (server->connections() > 0) io.run_one();
}

}  // namespace
}  // namespace panelgate::web::server_test
