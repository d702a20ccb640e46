#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "http_rig.hpp"

namespace panelgate::web::events_test {
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
    void tell(EventTopic topic, std::string_view json) {
        if (events.announce(topic.type)) events.publish(std::move(topic), json);
    }
    /// The events that a listener with this query gets when press's point, press, an unlisted
    /// station and floor2 have had one event each.
    std::string told(const std::string& query) {
        Client client = connect();
        client.send("GET /api/v1/events?" + query + " HTTP/1.1\r\nHost: x\r\n\r\n");
        std::string text = read_until(client, "id: ");
        tell({"point", "floor1", "press", "oil"}, "1");
        tell({"station", "floor1", "press", ""}, "2");
        tell({"transaction", "floor1", "9", ""}, "3");
        tell({"line", "floor2", "", ""}, "4");
        events.end();
        text = read_until(client, "the end");
        std::string numbers;
        for (std::size_t at = 0; (at = text.find("data: ", at)) != text.npos; ++at)
            numbers += text.at(at + 6);
        return numbers;
    }

    std::vector<points::Point> configured = std::vector<points::Point>(1);
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings = std::vector<points::Reading>(1);
    points::StationPoints oil{configured, blocks, readings};
};

TEST_F(ApiEvents, AreOfThoseLinesStationsAndPointsThatWereAskedFor) {
    configured[0].name = "oil";
    directory.stations[0].points = &oil;
    EXPECT_EQ(told("line=floor1"), "123");
    EXPECT_EQ(told("line=floor1,floor2"), "1234");
    EXPECT_EQ(told("station=press"), "12");
    EXPECT_EQ(told("station=floor1:31"), "12");
    EXPECT_EQ(told("station=floor1:9,press"), "123");
    EXPECT_EQ(told("point=press/oil"), "1");
    EXPECT_EQ(told("station=press&types=station,transaction"), "2");
}

TEST_F(ApiEvents, AreOfWhatThereIs) {
    configured[0].name = "oil";
    directory.stations[0].points = &oil;
    EXPECT_EQ(get("/api/v1/events?line=floor9").status(), 404u);
    EXPECT_EQ(get("/api/v1/events?station=nobody").status(), 404u);
    EXPECT_EQ(get("/api/v1/events?point=press/nothing").status(), 404u);
    EXPECT_EQ(get("/api/v1/events?point=oil").status(), 400u);
    EXPECT_EQ(get("/api/v1/events?types=line&station=press").status(), 400u);
    EXPECT_EQ(get("/api/v1/events?types=line,station&point=press/oil").status(), 400u);
}

TEST_F(ApiEvents, GoOnForWhoComesBackWithTheLastId) {
    const auto stays = events.listen({});
    for (const char* number : {"1", "2", "3"}) tell({"point", "floor1", "press", "oil"}, number);
    Client client = connect();
    client.send("GET /api/v1/events HTTP/1.1\r\nHost: x\r\nLast-Event-ID: 0-1\r\n\r\n");
    const std::string text = read_until(client, "data: 3\n\n");
    EXPECT_THAT(text, HasSubstr("retry: 2000\n\nid: 0-2\nevent: point\ndata: 2\n\nid: 0-3\n"));
}

TEST_F(ApiEvents, StreamTheTypesThatWereAskedFor) {
    Client client = connect();
    client.send("GET /api/v1/events?types=line,station HTTP/1.1\r\nHost: x\r\n\r\n");
    const std::string head = read_until(client, "\r\n\r\n");
    EXPECT_THAT(head, HasSubstr("Content-Type: text/event-stream"));
    EXPECT_THAT(head, HasSubstr("Server: panelgate/1.2.3"));
    tell({"point", "floor1", "press", "oil"}, R"({"a":1})");
    tell({"line", "floor1", "", ""}, R"({"b":2})");
    const std::string text = read_until(client, "{\"b\":2}\n\n");
    EXPECT_THAT(text, HasSubstr("retry: 2000\nid: 0-0\n\n"));
    EXPECT_THAT(text, HasSubstr("event: line\ndata: {\"b\":2}\n\n"));
    EXPECT_EQ(text.find("point"), std::string::npos);
}

TEST_F(ApiEvents, AreOfKnownTypes) {
    const Reply reply = get("/api/v1/events?types=line,bus");
    EXPECT_EQ(reply.status(), 400u);
    EXPECT_THAT(reply.body(), HasSubstr("there is no event 'bus'; types are point, station, "
                                        "line, transaction and discovery"));
}

TEST_F(ApiEvents, HaveRoomForSomeListenersOnly) {
    std::vector<std::shared_ptr<EventHub::Listener>> listeners;
    while (auto listener = events.listen({})) listeners.push_back(std::move(listener));
    const Reply reply = get("/api/v1/events");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Retry-After"), "5");
}

}  // namespace
}  // namespace panelgate::web::events_test
