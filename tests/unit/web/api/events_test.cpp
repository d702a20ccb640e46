#include <memory>
#include <vector>

#include "http_rig.hpp"

namespace panelgate::web {
namespace {

using ::testing::HasSubstr;

class ApiEvents : public HttpRig {
  protected:
    /// Runs the server until the client has received this.
    std::string read_until(Client& client, const std::string& end) {
        std::string text;
        while (text.find(end) == std::string::npos) {
            char some[256];
            boost::system::error_code error = boost::asio::error::would_block;
            client.socket().non_blocking(true);
            const std::size_t n = client.socket().read_some(boost::asio::buffer(some), error);
            text.append(some, n);
            if (error == boost::asio::error::would_block)
                io.run_one();
            else if (error)
                break;
        }
        return text;
    }
};

TEST_F(ApiEvents, StreamTheTypesThatWereAskedFor) {
    Client client = connect();
    client.send("GET /api/v1/events?types=line,station HTTP/1.1\r\nHost: x\r\n\r\n");
    const std::string head = read_until(client, "\r\n\r\n");
    EXPECT_THAT(head, HasSubstr("Content-Type: text/event-stream"));
    EXPECT_THAT(head, HasSubstr("Server: panelgate/1.2.3"));
    events.publish("point", R"({"a":1})");
    events.publish("line", R"({"b":2})");
    const std::string text = read_until(client, "{\"b\":2}\n\n");
    EXPECT_THAT(text, HasSubstr("event: line\ndata: {\"b\":2}\n\n"));
    EXPECT_EQ(text.find("point"), std::string::npos);
}

TEST_F(ApiEvents, AreOfKnownTypes) {
    const Reply reply = get("/api/v1/events?types=line,bus");
    EXPECT_EQ(reply.status(), 400u);
    EXPECT_THAT(reply.body(), HasSubstr("there is no event 'bus'; types are point, station, line "
                                        "and transaction"));
}

TEST_F(ApiEvents, HaveRoomForSomeListenersOnly) {
    std::vector<std::shared_ptr<EventHub::Listener>> listeners;
    while (auto listener = events.listen({})) listeners.push_back(std::move(listener));
    const Reply reply = get("/api/v1/events");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Retry-After"), "5");
}

}  // namespace
}  // namespace panelgate::web
