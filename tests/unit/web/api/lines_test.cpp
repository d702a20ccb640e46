#include <boost/asio/post.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "http_rig.hpp"

namespace panelgate::web::lines_test {
namespace {

using ::testing::HasSubstr;
using ApiLines = HttpRig;

TEST_F(ApiLines, ListsTheLines) {
    bus.line.queue_depth = 3;
    bus.line.load_percent = 50;
    const auto lines = get("/api/v1/lines").at("lines").as_array();
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(
        lines[0],
        json_of(R"({"name":"floor1","device":"/dev/ttyUSB0","state":"up","mode":"master","up":true,
        "load_percent":50,"queue_depth":3,"echo":"absent","findings":[]})"));
    EXPECT_EQ(get("/api/v1/lines/floor2").at("device"), "/dev/ttyUSB1");
    EXPECT_EQ(get("/api/v1/lines/floor3").status(), 404u);
}

TEST_F(ApiLines, TellsCausesInTheListAndFindingsOfALine) {
    EXPECT_EQ(get("/api/v1/lines/floor1").at("findings"), json_of("[]"));
    bus.line.findings = {{"wrong-baud", {}, "What is wrong.", "What to do.", "9 of 9"},
                         {"gap-too-short",
                          31,
                          "Why.",
                          "How.",
                          "5 of 6",
                          "press",
                          {{"silent_below", 5}, {"advised_ms", 10}}}};
    EXPECT_EQ(get("/api/v1/lines").at("lines").as_array()[0].at("findings"),
              json_of(R"(["wrong-baud","gap-too-short"])"));
    EXPECT_EQ(get("/api/v1/lines/floor1").at("findings"), json_of(R"([
        {"cause":"wrong-baud","station":null,"name":null,"text":"What is wrong.","advice":"What to do.",
         "evidence":"9 of 9","figures":{}},
        {"cause":"gap-too-short","station":31,"name":"press","text":"Why.","advice":"How.",
         "evidence":"5 of 6","figures":{"advised_ms":10,"silent_below":5}}])"));
}

TEST_F(ApiLines, P9ShowsWhatEachClientHasUsedOfALine) {
    bus.shares = {
        {"modbus_tcp 127.0.0.1:5000", 1500ms, 75, 12, "127.0.0.1", 20, 1, Outcome::timeout, 70ms},
        {"http 10.0.0.9", 500ms, 25, 4, "10.0.0.9", 4, 0, {}, {}, 2s}};
    EXPECT_EQ(get("/api/v1/lines/floor1").at("clients").as_array(),
              json_of(R"([{"name":"modbus_tcp 127.0.0.1:5000","address":"127.0.0.1","requests":20,
        "failed":1,"last_error":"timeout","last_error_ms":70,"gone_ms":null,"busy_seconds":1.5,"percent":75,
        "transactions":12},{"name":"http 10.0.0.9","address":"10.0.0.9","requests":4,"failed":0,
        "last_error":null,"last_error_ms":null,"gone_ms":2000,"busy_seconds":0.5,"percent":25,
        "transactions":4}])"));
}

TEST_F(ApiLines, P10ShowsStationsWithoutTouchingTheBus) {
    add_meter();
    bus.stations[31] = {Health::online, 1500ms};
    const auto stations = get("/api/v1/stations").at("stations").as_array();
    ASSERT_EQ(stations.size(), 2u);
    EXPECT_EQ(stations[0],
              json_of(R"({"name":"press","line":"floor1","id":31,"profile":"test-panel",
        "unit":101,"state":"online","read_only":false,"last_success_ms":1500})"));
    EXPECT_EQ(stations[1], json_of(R"({"name":"meter","line":"floor1","id":5,"profile":null,
        "unit":null,"state":"unknown","read_only":true,"last_success_ms":null})"));
    EXPECT_EQ(get("/api/v1/stations/floor1:31").at("name"), "press");
    EXPECT_EQ(get("/api/v1/stations/floor1%3A7").at("name"), "floor1:7");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, ShowsTheLastFramesOfALine) {
    bus.frames.push_back({1, TimePoint(1s), FrameKind::request, {5, 3}, {}});
    bus.frames.push_back({2,
                          TimePoint(2500ms),
                          FrameKind::request,
                          {0x1F, 0x01, 0x01, 0x20, 0x00, 0x05, 0xFF, 0x81},
                          "next in turn",
                          WallTime(2500ms)});
    bus.frames.push_back({3, TimePoint(3s), FrameKind::damaged, {}, {}});
    bus.made.push_back({7, TimePoint(2s), "refused"});
    EXPECT_EQ(get("/api/v1/lines/floor1/trace?last=2").json(), json_of(R"({"frames":[
        {"sequence":2,"time":"1970-01-01T00:00:02.500000Z","at":2.5,"direction":"sent","station":31,"bytes":"1F 01 01 20 00 05 FF 81","note":"request","why":"next in turn"},
        {"sequence":3,"time":"1970-01-01T00:00:00.000000Z","at":3,"direction":"discarded","station":null,"bytes":"","note":"damaged"}],
        "decisions":[{"sequence":7,"time":"1970-01-01T00:00:00.000000Z","at":2,"text":"refused"}],"transactions":[],"next":7})"));
    EXPECT_EQ(get("/api/v1/lines/floor1/trace").at("frames").as_array().size(), 3u);
    EXPECT_EQ(get("/api/v1/lines/floor1/trace?last=0").status(), 400u);
}

/// "1 2 | 3 next 3": frames, decisions, next.
std::string told(const Reply& reply) {
    std::string text;
    for (const char* list : {"frames", "decisions"}) {
        const boost::json::value entries = reply.at(list);
        for (const auto& entry : entries.as_array())
            text += std::to_string(entry.at("sequence").to_number<int>()) + ' ';
        if (std::string_view(list) == "frames") text += "| ";
    }
    return text + "next " + std::to_string(reply.at("next").to_number<int>());
}

TEST_F(ApiLines, GivesWhatFollowsASequenceNumber) {
    const std::string trace = "/api/v1/lines/floor1/trace";
    EXPECT_EQ(told(get(trace + "?since=0")), "| next 0");
    for (const int number : {1, 2, 4, 6})
        bus.frames.emplace_back().sequence = static_cast<std::uint64_t>(number);
    for (const int number : {3, 5})
        bus.made.emplace_back().sequence = static_cast<std::uint64_t>(number);
    EXPECT_EQ(told(get(trace + "?since=0")), "1 2 4 6 | 3 5 next 6");
    EXPECT_EQ(told(get(trace + "?since=4")), "6 | 5 next 6");
    EXPECT_EQ(told(get(trace + "?since=6")), "| next 6");
    EXPECT_EQ(told(get(trace + "?since=99")), "| next 6") << "the gateway was started anew";
    EXPECT_EQ(told(get(trace + "?since=1&last=2")), "2 | 3 next 3");
    for (const char* wrong : {"?since=", "?since=-1", "?since=x", "?since=99999999999999999999"})
        EXPECT_EQ(get(trace + wrong).status(), 400u) << wrong;
}

TEST_F(ApiLines, GivesAtMostAPageOfATrace) {
    for (std::uint64_t number = 1; number <= 1200; ++number) {
        if (number % 2 == 0) {
            bus.frames.emplace_back().sequence = number;
        } else {
            bus.made.emplace_back().sequence = number;
        }
    }
    EXPECT_EQ(get("/api/v1/lines/floor1/trace?last=501").status(), 400u);
    std::size_t entries = 0;
    std::uint64_t next = 0;
    for (int pages = 0; pages < 3; ++pages) {
        const Reply page = get("/api/v1/lines/floor1/trace?since=" + std::to_string(next));
        const std::size_t size =
            page.at("frames").as_array().size() + page.at("decisions").as_array().size();
        EXPECT_LE(size, 500u);
        entries += size;
        next = page.at("next").to_number<std::uint64_t>();
    }
    EXPECT_EQ(entries, 1200u);
    EXPECT_EQ(next, 1200u);
}

TEST_F(ApiLines, AListOfManyStationsLetsOthersHaveTheirTurn) {
    for (int i = 0; i < 1000; ++i) {
        directory.stations.push_back(directory.stations[0]);
        directory.stations.back().name = "s" + std::to_string(i);
    }
    Client client = connect();
    client.send("GET /api/v1/stations HTTP/1.1\r\nHost: x\r\n\r\n");
    std::size_t turns = 0;
    const std::function<void()> turn = [&] {
        ++turns;
        if (turns < 10'000) boost::asio::post(io, turn);
    };
    boost::asio::post(io, turn);
    const Reply reply = client.receive();
    EXPECT_EQ(reply.at("stations").as_array().size(), 1001u);
    EXPECT_GT(std::exchange(turns, 10'000u), 30u);
    io.poll();  // the pending turn is the last
}

TEST_F(ApiLines, AListWhoseCallerLeavesIsNotMadeToItsEnd) {
    for (int i = 0; i < 1000; ++i) directory.stations.push_back(directory.stations[0]);
    start();
    {
        Client client = connect();
        client.send("GET /api/v1/stations HTTP/1.1\r\nHost: x\r\n\r\n");
        for (int i = 0; i < 8; ++i) io.run_one();
    }
    server.reset();
    directory.stations.clear();
    io.poll();
}

TEST_F(ApiLines, SendsABroadcastAndDoesNotCallItConfirmed) {
    const Reply reply =
        ask("POST", "/api/v1/lines/floor1/broadcast",
            R"({"table":"holding-registers","address":100,"values":[1,2],"verify":false})");
    EXPECT_EQ(reply.status(), 202u);
    EXPECT_EQ(reply.json(), json_of(R"({"transmitted":true,"confirmed":false})"));
    EXPECT_EQ(bus.requests[0].station, 0);
    EXPECT_EQ(last_pdu(), "10 00 64 00 02 04 00 01 00 02");
}

TEST_F(ApiLines, BroadcastsByTheFunctionThatThePanelsTake) {
    const char* one = R"({"table":"holding-registers","address":1,"values":[7]})";
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/broadcast", one).status(), 202u);
    EXPECT_EQ(last_pdu(), "06 00 01 00 07");
    for (auto& rule : panel.functions) rule.broadcast = rule.code == 16;
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/broadcast", one).status(), 202u);
    EXPECT_EQ(last_pdu(), "10 00 01 00 01 02 00 07");
}

TEST_F(ApiLines, RefusesBroadcastsThatCannotBe) {
    const auto status = [&](const char* body) {
        return ask("POST", "/api/v1/lines/floor1/broadcast", body).status();
    };
    EXPECT_EQ(status(R"({"table":"coils","address":1,"values":[1],"verify":1})"), 400u);
    EXPECT_EQ(status(R"({"table":"relays","address":1,"values":[1]})"), 400u);
    EXPECT_EQ(status(R"({"table":"input-registers","address":1,"values":[1]})"), 422u);
    EXPECT_EQ(status(R"({"table":"coils","address":65536,"values":[1]})"), 400u);
    EXPECT_EQ(status(R"({"table":"coils","address":65535,"values":[1,1]})"), 422u);
    EXPECT_EQ(status(R"({"table":"coils","values":[1]})"), 400u);
    EXPECT_EQ(status(R"({"address":1,"values":[1]})"), 400u);
    EXPECT_EQ(status("nonsense"), 400u);
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor9/broadcast", "{}").status(), 404u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, DoesNotBroadcastOverAReadOnlyStation) {
    add_meter();
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/broadcast",
                  R"({"table":"coils","address":1,"values":[1]})")
                  .status(),
              403u);
    EXPECT_EQ(
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":0,"pdu":"0500010000"})").status(),
        403u);
}

TEST_F(ApiLines, TellsWhatIsWrongWithABroadcastBeforeWhomItWouldReach) {
    add_meter();
    const auto status = [&](const char* body) {
        return ask("POST", "/api/v1/lines/floor1/broadcast", body).status();
    };
    EXPECT_EQ(status(R"({"table":"coils","address":1,"values":["x"]})"), 400u);
    EXPECT_EQ(status(R"({"table":"coils","values":[1]})"), 400u);
    EXPECT_EQ(status(R"({"table":"input-registers","address":1,"values":[1]})"), 422u);
    EXPECT_EQ(status(R"({"table":"coils","address":1,"values":[1]})"), 403u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, P2WhatMayBeAMistakeInABodyIsNotExecuted) {
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/broadcast",
                  R"({"table":"coils","address":1,"values":[1],"verfy":true})")
                  .at("detail"),
              "unknown member 'verfy'; did you mean 'verify'?");
    EXPECT_EQ(
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":5,"station":6,"pdu":"0500010000"})")
            .status(),
        400u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, SaysWhyABroadcastDidNotLeave) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::line_down, false); };
    const Reply reply = ask("POST", "/api/v1/lines/floor1/broadcast",
                            R"({"table":"coils","address":1,"values":[1]})");
    EXPECT_EQ(reply.status(), 502u);
    EXPECT_EQ(reply.at("transmitted"), false);
}

TEST_F(ApiLines, PassesARawRequestAndItsReply) {
    const Reply reply =
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":5,"pdu":"0300640002"})");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.json(), json_of(R"({"pdu":"030400640065"})"));
    EXPECT_EQ(bus.requests[0].station, 5);
    EXPECT_FALSE(bus.requests[0].poll);
}

TEST_F(ApiLines, GivesAPanelsExceptionToARawRequestAsAnAnswer) {
    bus.script = [](const bus::Request&) { return test::FakeBus::reply({0x8B, 0x01}); };
    const Reply reply = ask("POST", "/api/v1/lines/floor1/raw", R"({"station":5,"pdu":"0b"})");
    EXPECT_EQ(reply.status(), 200u);
    EXPECT_EQ(reply.json(), json_of(R"({"pdu":"8B01","exception":1})"));
}

TEST_F(ApiLines, P2ARawRequestToStation0IsABroadcastAndNobodyHasReplied) {
    const Reply reply =
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":0,"pdu":"06000A0001"})");
    EXPECT_EQ(reply.status(), 202u);
    EXPECT_EQ(reply.json(), json_of(R"({"transmitted":true,"confirmed":false})"));
    EXPECT_EQ(bus.requests[0].station, 0);
}

TEST_F(ApiLines, SaysThatABroadcastCannotRead) {
    add_meter();
    const Reply reply =
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":0,"pdu":"0300640002"})");
    EXPECT_EQ(reply.status(), 403u);
    EXPECT_THAT(reply.body(),
                ::testing::HasSubstr("a broadcast can write (05, 06, 15, 16), but not read"));
    EXPECT_EQ(reply.at("transmitted"), false);
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/raw", R"({"station":0,"pdu":"03"})").at("detail"),
              reply.at("detail"))
        << "malformed as well";
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(bus.told_refused, 2);
}

TEST_F(ApiLines, ARawRequestThatAGuardRefusesWasNotAnsweredByThePanel) {
    bus.script = [](const bus::Request&) {
        bus::Answer answer = test::FakeBus::reply({0x83, 2});
        answer.transmitted = false;
        answer.refusal = bus::Refusal{bus::Rule::range, "press"};
        return answer;
    };
    const Reply reply =
        ask("POST", "/api/v1/lines/floor1/raw", R"({"station":31,"pdu":"0300640002"})");
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("transmitted"), false);
    EXPECT_EQ(reply.at("rule"), "range");
}

TEST_F(ApiLines, RefusesRawRequestsThatCannotBe) {
    add_meter();
    const auto status = [&](const std::string& body, const char* line = "floor1") {
        return ask("POST", std::string("/api/v1/lines/") + line + "/raw", body).status();
    };
    EXPECT_EQ(status(R"({"station":248,"pdu":"0b"})"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":"0"})"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":""})"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":7})"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":")" + std::string(508, '0') + "\"}"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":"030001"})"), 400u);
    EXPECT_EQ(status(R"({"station":5,"pdu":"0300010080"})"), 400u) << "more than a reply holds";
    EXPECT_EQ(status(R"({"station":5,"pdu":"0600010002"})"), 403u);
    EXPECT_EQ(status(R"({"station":9,"pdu":"0300010001"})", "floor2"), 404u);
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(status(R"({"station":5,"pdu":"0300010001"})"), 200u);
    EXPECT_EQ(status(R"({"station":5,"pdu":"030001007f"})"), 200u) << "a GT's larger frames";
}

}  // namespace
}  // namespace panelgate::web::lines_test
