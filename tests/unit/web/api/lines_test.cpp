// Lines and the stations on them: status, trace, broadcasts, raw requests, discovery.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "http_rig.hpp"

namespace panelgate::web::lines_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kTrace = "/api/v1/lines/floor1/trace";
constexpr const char* kBroadcast = "/api/v1/lines/floor1/broadcast";
constexpr const char* kRaw = "/api/v1/lines/floor1/raw";

class ApiLines : public HttpRig {
  protected:
    Reply broadcast(const std::string& body) { return ask("POST", kBroadcast, body); }
    Reply raw(const std::string& body) { return ask("POST", kRaw, body); }
};

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
    expect_gets("/api/v1/lines/", {{"floor3", 404, "there is no line 'floor3'"}});
}

TEST_F(ApiLines, TellsCausesInTheListAndFindingsOfALine) {
    EXPECT_EQ(get("/api/v1/lines/floor1").at("findings"), json_of("[]"));
    bus.line.findings = {{"wrong-baud", {}, "What is wrong.", "What to do.", "9 of 9"},
                         {"gap-too-short", 31, "Why.", "How.", "5 of 6", "press"}};
    bus.line.findings[1].figures = {{"silent_below", 5}, {"advised_ms", 10}};
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
    bus.stations[31].condition = Condition::well;
    const auto stations = get("/api/v1/stations").at("stations").as_array();
    ASSERT_EQ(stations.size(), 2u);
    EXPECT_EQ(stations[0],
              json_of(R"({"name":"press","line":"floor1","id":31,"profile":"test-panel",
        "unit":101,"state":"online","condition":"well","read_only":false,"last_success_ms":1500})"));
    EXPECT_EQ(stations[1], json_of(R"({"name":"meter","line":"floor1","id":5,"profile":null,
        "unit":null,"state":"unknown","condition":null,"read_only":true,"last_success_ms":null})"));
    EXPECT_EQ(get("/api/v1/stations/floor1:31").at("name"), "press");
    EXPECT_EQ(get("/api/v1/stations/floor1%3A7").at("name"), "floor1:7");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, ShowsTheLastFramesOfALine) {
    bus.frames.push_back({1, TimePoint(1s), FrameKind::request, {5, 3}, {}});
    const Bytes request{0x1F, 0x01, 0x01, 0x20, 0x00, 0x05, 0xFF, 0x81};
    bus.frames.push_back(
        {2, TimePoint(2500ms), FrameKind::request, request, "next in turn", WallTime(2500ms)});
    bus.frames.push_back({3, TimePoint(3s), FrameKind::damaged, {}, {}});
    bus.made.push_back({7, TimePoint(2s), "refused"});
    EXPECT_EQ(get(std::string(kTrace) + "?last=2").json(), json_of(R"({"frames":[
        {"sequence":2,"time":"1970-01-01T00:00:02.500000Z","at":2.5,"direction":"sent","station":31,"bytes":"1F 01 01 20 00 05 FF 81","note":"request","why":"next in turn"},
        {"sequence":3,"time":"1970-01-01T00:00:00.000000Z","at":3,"direction":"discarded","station":null,"bytes":"","note":"damaged"}],
        "decisions":[{"sequence":7,"time":"1970-01-01T00:00:00.000000Z","at":2,"text":"refused"}],"transactions":[],"next":7})"));
    EXPECT_EQ(get(kTrace).at("frames").as_array().size(), 3u);
    EXPECT_EQ(get(std::string(kTrace) + "?last=0").status(), 400u);
}

/// "1 2 | 3 next 3": frames, decisions, next.
std::string sequence(const Reply& reply) {
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
    const auto since = [&](const char* number) {
        return get(std::string(kTrace) + "?since=" + number);
    };
    EXPECT_EQ(sequence(since("0")), "| next 0");
    for (const std::uint64_t number : {1u, 2u, 4u, 6u}) bus.frames.emplace_back().sequence = number;
    for (const std::uint64_t number : {3u, 5u}) bus.made.emplace_back().sequence = number;
    EXPECT_EQ(sequence(since("0")), "1 2 4 6 | 3 5 next 6");
    EXPECT_EQ(sequence(since("4")), "6 | 5 next 6");
    EXPECT_EQ(sequence(since("6")), "| next 6");
    EXPECT_EQ(sequence(since("99")), "| next 6") << "the gateway was started anew";
    EXPECT_EQ(sequence(since("1&last=2")), "2 | 3 next 3");
    for (const char* wrong : {"", "-1", "x", "99999999999999999999"})
        EXPECT_EQ(since(wrong).status(), 400u) << wrong;
}

TEST_F(ApiLines, GivesAtMostAPageOfATrace) {
    for (std::uint64_t number = 1; number <= 1200; number += 2) {
        bus.made.emplace_back().sequence = number;
        bus.frames.emplace_back().sequence = number + 1;
    }
    EXPECT_EQ(get(std::string(kTrace) + "?last=501").status(), 400u);
    std::size_t entries = 0;
    std::uint64_t next = 0;
    for (int pages = 0; pages < 3; ++pages) {
        const Reply page = get(std::string(kTrace) + "?since=" + std::to_string(next));
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
    directory.stations.resize(1001, directory.stations[0]);
    const auto [reply, turns] = get_among_others("/api/v1/stations");
    EXPECT_EQ(reply.at("stations").as_array().size(), 1001u);
    EXPECT_GT(turns, 30u);
}

TEST_F(ApiLines, AListWhoseCallerLeavesIsNotMadeToItsEnd) {
    directory.stations.resize(1001, directory.stations[0]);
    {
        Client client = connect();
        client.send(http_text("GET", "/api/v1/stations"));
        for (int i = 0; i < 8; ++i) io.run_one();
    }
    server.reset();
    directory.stations.clear();
    io.poll();
}

TEST_F(ApiLines, SendsABroadcastAndDoesNotCallItConfirmed) {
    const Reply reply =
        broadcast(R"({"table":"holding-registers","address":100,"values":[1,2],"verify":false})");
    EXPECT_EQ(reply.status(), 202u);
    EXPECT_EQ(reply.json(), json_of(R"({"transmitted":true,"confirmed":false})"));
    EXPECT_EQ(bus.requests[0].station, 0);
    EXPECT_EQ(last_pdu(), "10 00 64 00 02 04 00 01 00 02");
    const char* one = R"({"table":"holding-registers","address":1,"values":[7]})";
    EXPECT_EQ(broadcast(one).status(), 202u);
    EXPECT_EQ(last_pdu(), "06 00 01 00 07");
    for (auto& rule : panel.functions) rule.broadcast = rule.code == 16;
    EXPECT_EQ(broadcast(one).status(), 202u);
    EXPECT_EQ(last_pdu(), "10 00 01 00 01 02 00 07") << "the function that the panels take";
    answer_with(Fault::line_down, false);
    EXPECT_EQ(status_and(broadcast(one), "transmitted"), "502 false");
}

TEST_F(ApiLines, TellsWhatIsWrongWithABroadcastBeforeWhomItWouldReach) {
    for (const bool over_read_only : {false, true}) {
        if (over_read_only) add_meter();
        expect_bodies(
            "POST", kBroadcast, 400,
            {R"({"table":"coils","address":1,"values":[1],"verify":1})",
             R"({"table":"coils","address":1,"values":["x"]})",
             R"({"table":"relays","address":1,"values":[1]})",
             R"({"table":"coils","address":65536,"values":[1]})",
             R"({"table":"coils","values":[1]})", R"({"address":1,"values":[1]})", "nonsense"});
        expect_bodies("POST", kBroadcast, 422,
                      {R"({"table":"input-registers","address":1,"values":[1]})",
                       R"({"table":"coils","address":65535,"values":[1,1]})"});
    }
    EXPECT_EQ(broadcast(R"({"table":"coils","address":1,"values":[1]})").status(), 403u);
    EXPECT_EQ(raw(R"({"station":0,"pdu":"0500010000"})").status(), 403u);
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor9/broadcast", "{}").status(), 404u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, P2WhatMayBeAMistakeInABodyIsNotExecuted) {
    expect_bodies("POST", kBroadcast,
                  {{R"({"table":"coils","address":1,"values":[1],"verfy":true})", 400,
                    "unknown member 'verfy'; did you mean 'verify'?"}});
    expect_bodies("POST", kRaw, {{R"({"station":5,"station":6,"pdu":"0500010000"})", 400}});
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiLines, PassesARawRequestAndItsReply) {
    EXPECT_EQ(status_and(raw(R"({"station":5,"pdu":"0300640002"})"), "pdu"), "200 030400640065");
    EXPECT_EQ(bus.requests[0].station, 5);
    EXPECT_FALSE(bus.requests[0].poll);
    answer_with({0x8B, 0x01});
    const Reply exception = raw(R"({"station":5,"pdu":"0b"})");
    EXPECT_EQ(status_and(exception, "pdu exception"), "200 8B01 1") << "that is an answer";
}

TEST_F(ApiLines, P2ARawRequestToStation0IsABroadcastAndNobodyHasReplied) {
    EXPECT_EQ(status_and(raw(R"({"station":0,"pdu":"06000A0001"})"), "transmitted confirmed"),
              "202 true false");
    EXPECT_EQ(bus.requests[0].station, 0);
}

TEST_F(ApiLines, SaysThatABroadcastCannotRead) {
    add_meter();
    const Reply reply = raw(R"({"station":0,"pdu":"0300640002"})");
    EXPECT_EQ(status_and(reply, "transmitted"), "403 false");
    EXPECT_THAT(reply.body(), HasSubstr("a broadcast can write (05, 06, 15, 16), but not read"));
    EXPECT_EQ(raw(R"({"station":0,"pdu":"03"})").at("detail"), reply.at("detail"))
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
    EXPECT_EQ(status_and(raw(R"({"station":31,"pdu":"0300640002"})"), "transmitted rule"),
              "422 false range");
}

TEST_F(ApiLines, RefusesRawRequestsThatCannotBe) {
    add_meter();
    const std::string endless = R"({"station":5,"pdu":")" + std::string(508, '0') + "\"}";
    expect_bodies(
        "POST", kRaw, 400,
        {R"({"station":256,"pdu":"0b"})", R"({"station":5,"pdu":"0"})", R"({"station":5,"pdu":""})",
         R"({"station":5,"pdu":7})", endless.c_str(), R"({"station":5,"pdu":"030001"})",
         R"({"station":5,"pdu":"0300010080"})"});  // more than a reply holds
    expect_bodies("POST", kRaw, 403, {R"({"station":5,"pdu":"0600010002"})"});
    expect_bodies("POST", "/api/v1/lines/floor2/raw", 404, {R"({"station":9,"pdu":"0300010001"})"});
    expect_bodies("POST", kRaw, 404, {R"({"station":248,"pdu":"0b"})"});  // not listed
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(raw(R"({"station":5,"pdu":"0300010001"})").status(), 200u);
    EXPECT_TRUE(bus.requests.back().verbatim);
    EXPECT_EQ(raw(R"({"station":5,"pdu":"030001007f"})").status(), 200u) << "a GT's larger frames";
}

class FakeDiscovery final : public DiscoverySource {
  public:
    std::optional<std::string> start(std::string_view line, std::string_view stations,
                                     unsigned share) override {
        if (stations == "x") return "is not a list";
        begun.push_back(std::string(line) + ' ' + std::string(stations) + ' ' +
                        std::to_string(share));
        told.state = DiscoveryReport::State::running;
        return std::nullopt;
    }
    void stop(std::string_view) override { told.state = DiscoveryReport::State::stopped; }
    DiscoveryReport report(std::string_view) const override { return told; }

    DiscoveryReport told;
    std::vector<std::string> begun;
};

class ApiDiscover : public HttpRig {
  protected:
    ApiDiscover() { discovery = &source; }
    Reply post(const std::string& body, const std::string& headers = "") {
        return ask("POST", kPath, body, headers);
    }

    static constexpr const char* kPath = "/api/v1/lines/floor1/discover";
    FakeDiscovery source;
};

TEST_F(ApiDiscover, BeginsWithAllAddressesAndATenthOfTheLineOrWithAListAndAShare) {
    EXPECT_EQ(status_and(post(""), "state"), "202 running");
    source.told = {};
    EXPECT_EQ(post(R"({"stations": "5,7-9", "share_percent": 50})").status(), 202u);
    EXPECT_THAT(source.begun, ElementsAre("floor1 1-247 10", "floor1 5,7-9 50"));
}

TEST_F(ApiDiscover, TellsWhatWasFound) {
    source.told.state = DiscoveryReport::State::done;
    source.told.share_percent = 10;
    source.told.asked = source.told.of = 245;
    source.told.stations = {{9, {"panasonic-gt", "omron-cp2e"}, "9 of 9 reads"}};
    source.told.asked_stations = "1-30,33-247";
    source.told.silent_stations = "1-8,10-30,33-247";
    source.told.yaml = "      - {id: 9}\n";
    source.told.bus = 9800ms;
    source.told.took = 98s;
    EXPECT_EQ(
        get(kPath).body(),
        R"({"line":"floor1","state":"done","share_percent":10,"asked":245,"refused":0,"of":245,)"
        R"("asked_stations":"1-30,33-247","silent_stations":"1-8,10-30,33-247",)"
        R"("found":1,"bus_ms":9800,"took_ms":98000,"stations":[{"id":9,)"
        R"("profiles":["panasonic-gt","omron-cp2e"],"evidence":"9 of 9 reads"}],)"
        R"("yaml":"      - {id: 9}\n"})"
        "\n");
    source.told = {};
    EXPECT_EQ(get(kPath).at("state"), "never");
}

TEST_F(ApiDiscover, IsOneAtATimeOnALineAndWithAKeyBegunOnce) {
    const std::string key = "Idempotency-Key: k1\r\n";
    EXPECT_EQ(post("", key).status(), 202u);
    const Reply second = post("");
    EXPECT_EQ(second.status(), 409u);
    EXPECT_THAT(second.body(), HasSubstr("already"));
    source.told.state = DiscoveryReport::State::done;
    const Reply again = post("", key);
    EXPECT_EQ(again.status(), 202u);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "true");
    EXPECT_EQ(source.begun.size(), 1u);
    EXPECT_EQ(ask("DELETE", kPath).at("state"), "stopped");
    EXPECT_EQ(post("").status(), 202u);
}

TEST_F(ApiDiscover, RefusesWhatMakesNoSense) {
    expect_bodies("POST", kPath, 400,
                  {R"({"stations": "x"})", R"({"stations": 5})", R"({"share_percent": 0})",
                   R"({"share_percent": 51})", R"({"station": "5"})", "[]"});
    for (const char* method : {"POST", "GET", "DELETE"})
        EXPECT_EQ(ask(method, "/api/v1/lines/attic/discover").status(), 404u) << method;
    EXPECT_TRUE(source.begun.empty());
}

TEST_F(ApiDiscover, IsForOperatorsAndNeedsALineThatIsUp) {
    bus.line.up = false;
    bus.line.state = "down: cannot open /dev/x";
    const Reply reply = post("");
    EXPECT_EQ(reply.status(), 502u);
    EXPECT_THAT(reply.body(), HasSubstr("the line is down: cannot open /dev/x"));
    EXPECT_TRUE(source.begun.empty());
    settings.anonymous = Role::viewer;
    start();
    EXPECT_EQ(post("").status(), 401u) << "there may be a token for that";
    EXPECT_EQ(ask("DELETE", kPath).status(), 401u);
    EXPECT_EQ(get(kPath).status(), 200u);
}

}  // namespace
}  // namespace panelgate::web::lines_test
