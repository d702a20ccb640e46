#include "panelgate/web/api/render.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "http_rig.hpp"

namespace panelgate::web::events_test {
namespace {

using ::testing::HasSubstr;

TEST(EventText, TellsAPointAsRestDoesAndWhoseItIs) {
    bus::StationRef station;
    station.name = "press";
    station.line = "floor1";
    points::PointReading reading;
    EXPECT_EQ(point_event(station, oil_point(), reading),
              R"({"name":"oil","value":null,"unit":"bar","quality":"bad","age_ms":null,)"
              R"("line":"floor1","station":"press"})");
    reading.value = points::Value(std::int64_t{2});
    reading.label = "high";
    reading.quality = points::Quality::good;
    reading.age = 1'999'999ns;
    EXPECT_EQ(point_event(station, oil_point(), reading),
              R"({"name":"oil","value":2,"label":"high","unit":"bar","quality":"good",)"
              R"("age_ms":1,"line":"floor1","station":"press"})");
}

TEST(EventText, TellsOfLinesStationsTransactionsAndDiscoveries) {
    EXPECT_EQ(line_event("floor1", "up", ""), R"({"line":"floor1","state":"up"})");
    EXPECT_EQ(line_event("floor1", "down", "a \"quoted\" why"),
              R"({"line":"floor1","state":"down","why":"a \"quoted\" why"})");
    EXPECT_EQ(transaction_event("floor1", "press", 3, "ok", 1500us),
              R"({"line":"floor1","station":"press","function":3,"outcome":"ok",)"
              R"("duration_ms":1.5})");
    EXPECT_EQ(transaction_event("floor1", "", 6, "ok", 2ms),
              R"({"line":"floor1","station":null,"function":6,"outcome":"ok","duration_ms":2})");
    EXPECT_EQ(station_event("floor1", "press", "offline"),
              R"({"line":"floor1","station":"press","event":"offline"})");
    EXPECT_EQ(discovery_event("floor1", "running", 3, 242, 1),
              R"({"line":"floor1","state":"running","asked":3,"of":242,"found":1})");
}

/// press has a point oil.
class ApiEvents : public HttpRig {
  protected:
    ApiEvents() { directory.stations[0].points = &oil; }
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
        if (events.is_wanted()) events.publish(std::move(topic), json);
    }
    /// The events that a listener with this query gets when press's point, press, an unlisted
    /// station and floor2 have had one event each.
    std::string told(const std::string& query) {
        Client client = connect();
        client.send(http_text("GET", "/api/v1/events?" + query));
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

    std::vector<points::Point> configured{oil_point()};
    std::vector<points::Poll> blocks;
    std::vector<points::Reading> readings = std::vector<points::Reading>(1);
    points::StationPoints oil{configured, blocks, readings};
};

TEST_F(ApiEvents, AreOfThoseLinesStationsAndPointsThatWereAskedFor) {
    EXPECT_EQ(told("line=floor1"), "123");
    EXPECT_EQ(told("line=floor1,floor2"), "1234");
    EXPECT_EQ(told("station=press"), "12");
    EXPECT_EQ(told("station=floor1:31"), "12");
    EXPECT_EQ(told("station=floor1:9,press"), "123");
    EXPECT_EQ(told("point=press/oil"), "1");
    EXPECT_EQ(told("station=press&types=station,transaction"), "2");
}

TEST_F(ApiEvents, AreOfWhatThereIs) {
    const char* events_of = "/api/v1/events?";
    expect_gets(events_of, 404, {"line=floor9", "station=nobody", "point=press/nothing"});
    expect_gets(events_of, 400,
                {"point=oil", "types=line&station=press", "types=line,station&point=press/oil"});
    expect_gets(events_of, {{"types=line,bus", 400,
                             "there is no event 'bus'; types are point, station, line, "
                             "transaction, discovery and alarm"}});
}

TEST_F(ApiEvents, GoOnForWhoComesBackWithTheLastId) {
    const auto stays = events.listen({});
    for (const char* number : {"1", "2", "3"}) tell({"point", "floor1", "press", "oil"}, number);
    Client client = connect();
    client.send(http_text("GET", "/api/v1/events", "Last-Event-ID: 0-1\r\n"));
    const std::string text = read_until(client, "data: 3\n\n");
    EXPECT_THAT(text, HasSubstr("retry: 2000\n\nid: 0-2\nevent: point\ndata: 2\n\nid: 0-3\n"));
}

TEST_F(ApiEvents, StreamTheTypesThatWereAskedFor) {
    Client client = connect();
    client.send(http_text("GET", "/api/v1/events?types=line,station"));
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

TEST_F(ApiEvents, HaveRoomForSomeListenersOnly) {
    std::vector<std::shared_ptr<EventHub::Listener>> listeners;
    while (auto listener = events.listen({})) listeners.push_back(std::move(listener));
    const Reply reply = get("/api/v1/events");
    EXPECT_EQ(reply.status(), 503u);
    EXPECT_EQ(reply.header("Retry-After"), "5");
}

}  // namespace
}  // namespace panelgate::web::events_test
