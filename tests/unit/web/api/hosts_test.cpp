#include <string>

#include "http_rig.hpp"

namespace panelgate::web::hosts_test {
namespace {

/// A whole request, as a browser or a script sends it.
class Hosts : public HttpRig {
  protected:
    Reply say(const std::string& text) {
        Client client = connect();
        client.send(text + "\r\n");
        return client.receive();
    }
    unsigned status(const std::string& text) { return say(text).status(); }
};

TEST_F(Hosts, OfOthersAreMisdirected) {
    const std::string body = "Content-Length: 14\r\n\r\n{\"values\":[1]}";
    const std::string write = "PUT /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: ";
    Client client = connect();
    client.send(write +
                "evil.example:8080\r\nOrigin: http://evil.example:8080\r\n"
                "Content-Type: application/json\r\n" +
                body);
    const Reply reply = client.receive();
    EXPECT_EQ(reply.status(), 421u);
    EXPECT_EQ(reply.at("title"), "Misdirected Request");
    EXPECT_TRUE(bus.requests.empty());
    client.send(write + "X.:8080\r\n" + body);
    EXPECT_EQ(client.receive().status(), 200u);
    EXPECT_EQ(status("GET /nothing HTTP/1.1\r\nHost: evil\r\n"), 421u);
    EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: 127.0.0.1:1\r\n"), 200u);
    EXPECT_EQ(status("GET / HTTP/1.0\r\nHost: evil\r\n"), 421u);
}

TEST_F(Hosts, AreNotAskedOfProbes) {
    EXPECT_EQ(status("GET /healthz HTTP/1.1\r\nHost: pod.cluster\r\n"), 200u);
    EXPECT_EQ(status("GET /readyz HTTP/1.0\r\n"), 200u);
    EXPECT_EQ(status("GET /healthz HTTP/1.1\r\n"), 200u);
    EXPECT_EQ(status("GET /healthz HTTP/1.1\r\nHost: x\r\nHost: x\r\n"), 400u);
}

TEST_F(Hosts, OfProbesMayAddQueries) {
    EXPECT_EQ(status("GET /healthz?x=1 HTTP/1.1\r\nHost: x\r\n"), 200u);
    EXPECT_EQ(status("GET /readyz?x=1&x=2 HTTP/1.1\r\nHost: x\r\n"), 200u);
}

TEST_F(Hosts, StandInARequestOnce) {
    EXPECT_EQ(status("GET / HTTP/1.1\r\n"), 400u);
    EXPECT_EQ(status("GET / HTTP/1.1\r\nHost:\r\n"), 400u);
    EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x\r\nHost: x\r\n"), 400u);
    EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: x y\r\n"), 400u);
    EXPECT_EQ(status("GET / HTTP/1.0\r\n"), 200u);
}

TEST_F(Hosts, OfAnAbsoluteTargetCount) {
    EXPECT_EQ(status("GET http://x:8080/api/v1/lines HTTP/1.1\r\nHost: evil\r\n"), 200u);
    EXPECT_EQ(status("GET http://evil/api/v1/lines HTTP/1.1\r\nHost: x\r\n"), 421u);
    EXPECT_EQ(status("GET http://x/ HTTP/1.1\r\n"), 400u);
}

TEST_F(Hosts, AreToldWhatTheyCanAsk) {
    const Reply path = say("OPTIONS /api/v1/stations/press/coils/1 HTTP/1.1\r\nHost: x\r\n");
    EXPECT_EQ(path.status(), 204u);
    EXPECT_EQ(path.header("Allow"), "GET, HEAD, PUT, OPTIONS");
    EXPECT_EQ(path.header("Content-Length"), "");
    const Reply server = say("OPTIONS * HTTP/1.1\r\nHost: x\r\n");
    EXPECT_EQ(server.status(), 204u);
    EXPECT_EQ(server.header("Allow"), "GET, HEAD, POST, DELETE, PUT, OPTIONS");
    EXPECT_EQ(status("GET * HTTP/1.1\r\nHost: x\r\n"), 400u);
}

TEST_F(Hosts, NeverHearTheirBytesRaw) {
    const Reply reply = say("GET /api/v1/stations/%C3%28 HTTP/1.1\r\nHost: x\r\n");
    EXPECT_EQ(reply.status(), 400u);
    EXPECT_EQ(reply.body().find('\xC3'), std::string::npos);
}

}  // namespace
}  // namespace panelgate::web::hosts_test
