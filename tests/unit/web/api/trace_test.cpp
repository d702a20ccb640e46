// Transactions and incidents of a line, for programs, people and Wireshark.
#include <string>

#include "answer.hpp"
#include "http_rig.hpp"
#include "panelgate/bus/trace.hpp"
#include "support/hex.hpp"

namespace panelgate::web::trace_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kTrace = "/api/v1/lines/floor1/trace";
constexpr const char* kIncidents = "/api/v1/lines/floor1/incidents";

bus::TraceTransaction transaction() {
    bus::TraceTransaction one;
    one.id = 17;
    one.first = 40;
    one.sequence = 43;
    one.station = 31;
    one.end = TransactionEnd::ok;
    one.reason = "read";
    one.client = "http 10.0.0.9";
    one.time = WallTime(2500ms);
    one.arrived = TimePoint(1000ms);
    one.granted = TimePoint(1002ms);
    one.first_bit_out = TimePoint(1003ms);
    one.last_bit_out = TimePoint(1005ms);
    one.first_byte_in = TimePoint(1010ms);
    one.last_byte_in = TimePoint(1012ms);
    one.answered = TimePoint(1013ms);
    one.request = "1F 03 00 64"_hex;
    one.reply = "1F 03 02 00 07"_hex;
    bus::TraceFrame noise;
    noise.kind = FrameKind::damaged;
    noise.bytes = "FF"_hex;
    one.discarded.push_back(noise);
    return one;
}

bus::TraceFrame frame(std::uint64_t sequence, FrameKind kind, std::uint64_t of) {
    bus::TraceFrame made;
    made.sequence = sequence;
    made.kind = kind;
    made.bytes =
        kind == FrameKind::reply ? "1F 03 02 00 07 00 00"_hex : "1F 03 00 64 00 01 C6 6B"_hex;
    made.transaction = of;
    return made;
}

class ApiTrace : public HttpRig {
  protected:
    ApiTrace() {
        bus.frames = {frame(40, FrameKind::request, 17), frame(42, FrameKind::reply, 17),
                      frame(44, FrameKind::request, 18)};
        bus.made.push_back({41, TimePoint(1s), "station 5 is refused", WallTime(2501ms)});
        bus.exchanges.push_back(transaction());
    }
    Reply text() { return ask("GET", kTrace, "", "Accept: text/plain\r\n"); }
};

TEST_F(ApiTrace, ATransactionHasItsInstantsAndItsFrames) {
    const boost::json::value told = get(kTrace).at("transactions").as_array().at(0);
    EXPECT_EQ(told, json_of(R"({"id":17,"sequence":40,"ended":43,
        "time":"1970-01-01T00:00:02.500000Z","station":31,"reason":"read",
        "client":"http 10.0.0.9","outcome":"ok","arrived":1,"granted":1.002,
        "first_bit_out":1.003,"last_bit_out":1.005,"first_byte_in":1.01,"last_byte_in":1.012,
        "answered":1.013,"request":"1F 03 00 64","reply":"1F 03 02 00 07",
        "discarded":[{"note":"damaged","bytes":"FF"}]})"));
    EXPECT_EQ(get(kTrace).at("frames").as_array().at(0).at("transaction"), 17);
}

TEST_F(ApiTrace, WhatDidNotHappenIsNull) {
    bus.exchanges[0].arrived = bus.exchanges[0].answered = std::nullopt;
    bus.exchanges[0].first_byte_in = bus.exchanges[0].last_byte_in = std::nullopt;
    bus.exchanges[0].client.clear();
    bus.exchanges[0].reply.clear();
    const boost::json::value told = get(kTrace).at("transactions").as_array().at(0);
    for (const char* name :
         {"arrived", "first_byte_in", "last_byte_in", "answered", "client", "reply"})
        EXPECT_TRUE(told.at(name).is_null()) << name;
}

TEST_F(ApiTrace, APageFollowsByTheNumberOfATransactionsEnd) {
    const Reply page = get(std::string(kTrace) + "?since=42");
    EXPECT_EQ(page.at("transactions").as_array().size(), 1u);
    EXPECT_EQ(page.at("frames").as_array().size(), 1u);
    EXPECT_EQ(page.at("next"), 44);
    EXPECT_EQ(get(std::string(kTrace) + "?since=43").at("transactions").as_array().size(), 0u);
    const Reply cut = get(std::string(kTrace) + "?since=40&last=2");
    EXPECT_EQ(cut.at("next"), 42);
    EXPECT_EQ(cut.at("transactions").as_array().size(), 0u) << "it ends behind that";
}

TEST_F(ApiTrace, IsAlignedTextForPeople) {
    const Reply reply = text();
    EXPECT_EQ(reply.header("Content-Type"), "text/plain; charset=utf-8");
    EXPECT_EQ(reply.header("Vary"), "Accept");
    EXPECT_EQ(reply.body(),
              "TIME                              ID STATION REASON      OUTCOME     QUEUE     OUT"
              "   THINK      IN   TOTAL  CLIENT\n"
              "1970-01-01T00:00:02.500000Z       17      31 read        ok            2.0     2.0"
              "     5.0     2.0    13.0  http 10.0.0.9\n"
              "                               > 1F 03 00 64\n"
              "                               < 1F 03 02 00 07\n"
              "                               x FF  damaged\n"
              "1970-01-01T00:00:02.501000Z  station 5 is refused\n"
              "1970-01-01T00:00:00.000000Z    > 1F 03 00 64 00 01 C6 6B  request\n");
}

TEST_F(ApiTrace, TextSaysWithADashWhatDidNotHappen) {
    bus.exchanges[0].end = TransactionEnd::timeout;
    bus.exchanges[0].first_byte_in = bus.exchanges[0].last_byte_in = std::nullopt;
    EXPECT_THAT(text().body(), HasSubstr("timeout       2.0     2.0       -       -    13.0"));
}

TEST(Accept, NamesAType) {
    EXPECT_TRUE(prefers("text/plain", "text/plain"));
    EXPECT_FALSE(prefers("*/*", "text/plain"));
    EXPECT_FALSE(prefers("text/plain;q=0.5, application/json", "text/plain"));
    EXPECT_FALSE(prefers("text/csv", "text/plain"));
}

TEST_F(ApiTrace, IsACaptureForWireshark) {
    const Reply reply = get("/api/v1/lines/floor1/trace.pcapng");
    EXPECT_EQ(reply.header("Content-Type"), "application/x-pcapng");
    EXPECT_EQ(reply.header("Content-Disposition"), "attachment; filename=\"floor1.pcapng\"");
    EXPECT_THAT(reply.body(), StartsWith("\x0A\x0D\x0D\x0A"));
    EXPECT_THAT(reply.body(), HasSubstr("panelgate 1.2.3"));
    EXPECT_THAT(reply.body(), HasSubstr("decided: station 5 is refused"));
    EXPECT_EQ(get("/api/v1/lines/floor9/trace.pcapng").status(), 404u);
}

TEST_F(ApiTrace, ALongCaptureHasEveryFrameAndLetsOthersHaveTheirTurn) {
    bus.frames.clear();
    for (std::uint64_t i = 1; i <= 2000; ++i) bus.frames.push_back(frame(i, FrameKind::reply, 1));
    Client client = connect();
    client.send("GET /api/v1/lines/floor1/trace.pcapng HTTP/1.1\r\nHost: x\r\n\r\n");
    std::size_t turns = 0;
    const std::function<void()> turn = [&] {
        if (++turns < 10'000) boost::asio::post(io, turn);
    };
    boost::asio::post(io, turn);
    const std::string body = client.receive().body();
    EXPECT_GT(std::exchange(turns, 10'000u), 30u);
    io.poll();
    std::size_t packets = 0;
    for (auto at = body.find("mbrtu"); at != body.npos; at = body.find("mbrtu", at + 1)) ++packets;
    EXPECT_EQ(packets, 2000u);
}

TEST_F(ApiTrace, ListsIncidentsTheOldestFirst) {
    EXPECT_EQ(get(kIncidents).json(), json_of(R"({"incidents":[]})"));
    bus.frozen.push_back({{3, WallTime(2s), 31, "timeout", 2, true, false}, {}});
    bus.frozen.push_back({{4, WallTime(3s), std::nullopt, "line_down", 1, false, false}, {}});
    EXPECT_EQ(get(kIncidents).json(), json_of(R"({"incidents":[
        {"id":3,"time":"1970-01-01T00:00:02.000000Z","station":31,"cause":"timeout","errors":2,
         "complete":true,"read":false},
        {"id":4,"time":"1970-01-01T00:00:03.000000Z","station":null,"cause":"line_down","errors":1,
         "complete":false,"read":false}]})"));
}

TEST_F(ApiTrace, GivesAnIncidentAndRemembersThatItWasRead) {
    bus.frozen.push_back(
        {{3, WallTime(2s), 31, "timeout", 2, true, false}, {bus.frames, bus.made, bus.exchanges}});
    const Reply one = get(std::string(kIncidents) + "/3");
    EXPECT_EQ(one.at("cause"), "timeout");
    EXPECT_EQ(one.at("frames").as_array().size(), 3u);
    EXPECT_EQ(one.at("decisions").as_array().size(), 1u);
    EXPECT_EQ(one.at("transactions").as_array().at(0).at("id"), 17);
    EXPECT_TRUE(bus.frozen[0].head.read);
    const Reply file = get(std::string(kIncidents) + "/3.pcapng");
    EXPECT_EQ(file.header("Content-Disposition"), "attachment; filename=\"floor1-3.pcapng\"");
    EXPECT_THAT(file.body(), HasSubstr("mbrtu"));
    for (const char* wrong : {"/4", "/x", "/.pcapng", "/3.pcap", "/-3"})
        EXPECT_EQ(get(std::string(kIncidents) + wrong).status(), 404u) << wrong;
}

class ApiCosts : public HttpRig {
  protected:
    ApiCosts() {
        bus.script = [this](const bus::Request& request) {
            bus::Answer answer = answer_from_addresses(request);
            for (std::uint64_t i = 0; i < attempts; ++i) answer.transactions.add(++last);
            return answer;
        };
    }
    static std::string named(const Reply& reply) { return reply.header("Panelgate-Transactions"); }

    std::uint64_t attempts = 1;
    std::uint64_t last = 16;
};

TEST_F(ApiCosts, AnAnswerNamesTheTransactionsThatItCost) {
    EXPECT_EQ(named(get("/api/v1/stations/press/holding-registers/1")), "17");
    attempts = 2;
    EXPECT_EQ(named(get("/api/v1/stations/press/holding-registers/1")), "18, 19");
    attempts = 1;
    EXPECT_EQ(
        named(ask("POST", "/api/v1/lines/floor1/raw", R"({"station":31,"pdu":"0300640001"})")),
        "20");
    EXPECT_EQ(named(get("/api/v1/stations/floor1:9/holding-registers/0?count=300")), "21, 22, 23");
}

TEST_F(ApiCosts, OnOneConnectionEachAnswerNamesItsOwn) {
    Client client = connect();
    EXPECT_EQ(named(client.ask("GET", "/api/v1/stations/press/holding-registers/1")), "17");
    EXPECT_EQ(named(client.ask("GET", "/api/v1/stations/press/holding-registers/1")), "18");
    EXPECT_EQ(named(client.ask("GET", "/api/v1/lines")), "");
}

TEST_F(ApiCosts, WhatCostNothingNamesNone) {
    attempts = 0;
    EXPECT_EQ(named(get("/api/v1/stations/press/holding-registers/1")), "");
    EXPECT_EQ(named(get("/api/v1/stations/press")), "");
}

TEST_F(ApiCosts, OfSeveralLinesEachIsNamedWithItsLine) {
    test::FakeBus other(io.get_executor());
    other.script = [](const bus::Request& request) {
        bus::Answer answer = answer_from_addresses(request);
        answer.transactions.add(3);
        return answer;
    };
    directory.lines[1].bus = &other;
    const Reply reply = ask("POST", "/api/v1/read",
                            R"({"items":[{"station":"press","device":"UW1"},
                                {"station":"floor2:9","table":"coils","address":0}]})");
    EXPECT_EQ(named(reply), "17") << "the other was refused";
    directory.lines[1].pass_unlisted_stations = true;
    const Reply both = ask("POST", "/api/v1/read",
                           R"({"items":[{"station":"press","device":"UW1"},
                               {"station":"floor2:9","table":"coils","address":0}]})");
    EXPECT_EQ(named(both), "floor1:18, floor2:3");
    server.reset();
    io.poll();
}

TEST_F(ApiCosts, AKeyedWriteThatIsRepeatedNamesWhatTheFirstCost) {
    const std::string key = "Idempotency-Key: k1\r\n";
    const char* body = R"({"values":[7]})";
    const std::string path = "/api/v1/stations/press/devices/UW1";
    EXPECT_EQ(named(ask("PUT", path, body, key)), "17");
    const Reply again = ask("PUT", path, body, key);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "true");
    EXPECT_EQ(named(again), "17");
    EXPECT_EQ(last, 17u);
}

TEST_F(ApiCosts, AnEndlessListIsCut) {
    attempts = 900;
    const Reply reply = get("/api/v1/stations/floor1:9/holding-registers/0?count=125");
    EXPECT_THAT(named(reply), StartsWith("17, 18, 19"));
    EXPECT_LE(named(reply).size(), 4000u);
}

}  // namespace
}  // namespace panelgate::web::trace_test
