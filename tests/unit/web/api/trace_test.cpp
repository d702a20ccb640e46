// Transactions and incidents of a line, for programs, people and Wireshark.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "http_rig.hpp"
#include "panelgate/bus/trace.hpp"
#include "support/hex.hpp"

namespace panelgate::web::trace_test {
namespace {

using ::testing::HasSubstr;
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
    bus.exchanges[0].end = TransactionEnd::timeout;
    bus.exchanges[0].first_byte_in = bus.exchanges[0].last_byte_in = std::nullopt;
    bus.exchanges[0].arrived = bus.exchanges[0].answered = std::nullopt;
    bus.exchanges[0].client.clear();
    bus.exchanges[0].reply.clear();
    const boost::json::value told = get(kTrace).at("transactions").as_array().at(0);
    for (const char* name :
         {"arrived", "first_byte_in", "last_byte_in", "answered", "client", "reply"})
        EXPECT_TRUE(told.at(name).is_null()) << name;
}

TEST_F(ApiTrace, APageFollowsByTheNumberOfATransactionsEnd) {
    const auto page = [&](const char* since) { return get(kTrace + std::string(since)); };
    const Reply last = page("?since=42");
    EXPECT_EQ(last.at("transactions").as_array().size(), 1u);
    EXPECT_EQ(last.at("frames").as_array().size(), 1u);
    EXPECT_EQ(last.at("next"), 44);
    EXPECT_EQ(status_and(page("?since=43"), "transactions"), "200 []");
    EXPECT_EQ(status_and(page("?since=40&last=2"), "next transactions"), "200 42 []")
        << "it ends behind that";
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
    const auto [reply, turns] = get_among_others("/api/v1/lines/floor1/trace.pcapng");
    const std::string& body = reply.body();
    EXPECT_GT(turns, 30u);
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
    expect_gets(kIncidents, 404, {"/4", "/x", "/.pcapng", "/3.pcap", "/-3"});
}

/// Each answer costs so many transactions, numbered from 17 on.
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
    const std::string one = "/api/v1/stations/press/holding-registers/1";
    const std::string many = "/api/v1/stations/floor1:9/holding-registers/0?count=";
    Client client = connect();
    EXPECT_EQ(named(client.ask("GET", one)), "17");
    attempts = 2;
    EXPECT_EQ(named(client.ask("GET", one)), "18, 19") << "on one connection each its own";
    attempts = 1;
    EXPECT_EQ(
        named(ask("POST", "/api/v1/lines/floor1/raw", R"({"station":31,"pdu":"0300640001"})")),
        "20");
    EXPECT_EQ(named(get(many + "300")), "21, 22, 23");
    EXPECT_EQ(named(client.ask("GET", "/api/v1/lines")), "");
    attempts = 900;
    const Reply endless = get(many + "125");
    EXPECT_THAT(named(endless), StartsWith("24, 25, 26"));
    EXPECT_LE(named(endless).size(), 4000u);
    attempts = 0;
    for (const std::string& nothing : {one, std::string("/api/v1/stations/press")})
        EXPECT_EQ(named(get(nothing)), "") << nothing;
}

TEST_F(ApiCosts, OfSeveralLinesEachIsNamedWithItsLine) {
    test::FakeBus other(io.get_executor());
    other.script = [](const bus::Request& request) {
        bus::Answer answer = answer_from_addresses(request);
        answer.transactions.add(3);
        return answer;
    };
    directory.lines[1].bus = &other;
    const char* items = R"({"items":[{"station":"press","device":"UW1"},
                                     {"station":"floor2:9","table":"coils","address":0}]})";
    EXPECT_EQ(named(ask("POST", "/api/v1/read", items)), "17") << "the other was refused";
    directory.lines[1].pass_unlisted_stations = true;
    EXPECT_EQ(named(ask("POST", "/api/v1/read", items)), "floor1:18, floor2:3");
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

}  // namespace
}  // namespace panelgate::web::trace_test
