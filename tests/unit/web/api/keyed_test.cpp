#include "http_rig.hpp"
#include "key_book.hpp"

namespace panelgate::web::keyed_test {
namespace {

using ::testing::HasSubstr;

class Keys : public ::testing::Test {
  protected:
    enum class Outcome { fresh, answer, in_flight, other, full };
    Outcome begin(const std::string& client, const std::string& key, std::uint64_t request = 1) {
        const auto begun = book.begin(now, {client, key}, request, std::make_shared<Caller>(1, ""));
        if (std::holds_alternative<KeyBook::Fresh>(begun)) return Outcome::fresh;
        const auto* refused = std::get_if<Problem>(&begun);
        if (refused == nullptr) return Outcome::answer;
        if (refused->status == 409) return Outcome::in_flight;
        return refused->status == 422 ? Outcome::other : Outcome::full;
    }
    void end(const std::string& client, const std::string& key) {
        HttpResponse answer;
        answer.body = "1234567890";
        book.end(now, {client, key}, answer);
    }

    ApiSettings settings{
        .keys_kept = 10min, .max_keys = 4, .max_keys_of_client = 3, .max_kept = 25};
    KeyBook book{settings};
    TimePoint now{1h};
};

TEST_F(Keys, AreOfOneRequestOfOneClient) {
    EXPECT_EQ(begin("a", "k"), Outcome::fresh);
    EXPECT_EQ(begin("a", "k"), Outcome::in_flight);
    EXPECT_EQ(begin("b", "k"), Outcome::fresh);
    end("a", "k");
    EXPECT_EQ(begin("a", "k"), Outcome::answer);
    EXPECT_EQ(begin("a", "k", 2), Outcome::other);
    EXPECT_EQ(begin("b", "k"), Outcome::in_flight);
}

TEST_F(Keys, AreForgottenWhenTheirTimeIsOverAndNotBefore) {
    begin("a", "k");
    end("a", "k");
    now += 10min - 1ns;
    EXPECT_EQ(begin("a", "k"), Outcome::answer);
    now += 1ns;
    EXPECT_EQ(begin("a", "k", 2), Outcome::fresh);
    EXPECT_EQ(book.size(), 1u);
}

TEST_F(Keys, OfWhatHadNoEffectMayBeUsedAgain) {
    begin("a", "k");
    book.drop({"a", "k"});
    EXPECT_EQ(begin("a", "k", 2), Outcome::fresh);
}

TEST_F(Keys, OfOneClientLeaveRoomForOthers) {
    for (const char* key : {"1", "2", "3"}) EXPECT_EQ(begin("a", key), Outcome::fresh);
    EXPECT_EQ(begin("a", "4"), Outcome::full);
    EXPECT_EQ(begin("b", "4"), Outcome::fresh);
    EXPECT_EQ(begin("c", "4"), Outcome::full);
    book.drop({"a", "1"});
    EXPECT_EQ(begin("c", "4"), Outcome::fresh);
}

TEST_F(Keys, AreBoundedByTheBytesOfTheirAnswersToo) {
    for (const char* key : {"1", "2", "3"}) begin("a", key), end("a", key);
    EXPECT_EQ(begin("b", "4"), Outcome::full);
    now += 10min;
    EXPECT_EQ(begin("b", "4"), Outcome::fresh);
}

TEST_F(Keys, TheirWorkersLeaveWhenTheyAreDismissed) {
    const auto worker = std::make_shared<Caller>(1, "");
    book.begin(now, {"a", "k"}, 1, worker);
    book.dismiss();
    EXPECT_TRUE(worker->has_left());
}

class ApiKeyed : public HttpRig {
  protected:
    Reply put(const std::string& key, const std::string& body = R"({"values":[9]})",
              const std::string& more = "") {
        return ask("PUT", "/api/v1/stations/press/devices/UW7", body,
                   "Idempotency-Key: " + key + "\r\n" + more);
    }
    static std::string raw_put(const std::string& key) {
        return "PUT /api/v1/stations/press/devices/UW7 HTTP/1.1\r\nHost: x\r\nIdempotency-Key: " +
               key + "\r\nContent-Length: 14\r\n\r\n{\"values\":[9]}";
    }
};

TEST_F(ApiKeyed, P2ARepeatedWriteGetsTheFirstAnswerAndGoesOutOnce) {
    const Reply first = put("\"a-1\"");
    EXPECT_EQ(first.status(), 200u);
    EXPECT_EQ(first.header("Idempotency-Replayed"), "");
    const Reply again = put("a-1");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_EQ(again.body(), first.body());
    EXPECT_EQ(again.header("Idempotency-Replayed"), "true");
    EXPECT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(put("a-2").status(), 200u);
    EXPECT_EQ(bus.requests.size(), 2u);
    now += 10min;
    EXPECT_EQ(put("a-1").status(), 200u);
    EXPECT_EQ(bus.requests.size(), 3u);
}

TEST_F(ApiKeyed, P2AnUnknownOutcomeIsRememberedToo) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::timeout, true); };
    EXPECT_EQ(put("k").status(), 504u);
    bus.script = [](const bus::Request& request) { return answer_from_addresses(request); };
    EXPECT_EQ(put("k").status(), 504u);
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiKeyed, WhatNeverLeftMayBeTriedAgain) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::busy, false); };
    EXPECT_EQ(put("k").status(), 503u);
    EXPECT_EQ(put("k", "{").status(), 400u);
    bus.script = [](const bus::Request& request) { return answer_from_addresses(request); };
    EXPECT_EQ(put("k").status(), 200u);
}

TEST_F(ApiKeyed, AnotherRequestWithTheSameKeyIsRefused) {
    put("k");
    const Reply other = put("k", R"({"values":[8]})");
    EXPECT_EQ(other.status(), 422u);
    EXPECT_EQ(other.at("detail"), "this Idempotency-Key was that of another request");
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiKeyed, AKeyUnderWayIsAConflict) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client first = connect();
    first.send(raw_put("k"));
    while (bus.requests.empty()) io.run_one();
    const Reply second = put("k");
    EXPECT_EQ(second.status(), 409u);
    EXPECT_EQ(second.at("title"), "Conflict");
    EXPECT_EQ(second.header("Retry-After"), "1");
    bus.release(answer_from_addresses(bus.requests[0]));
    EXPECT_EQ(first.receive().status(), 200u);
}

TEST_F(ApiKeyed, P2WhoComesBackForALostAnswerGetsIt) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    bus.completes_on_cancel = false;  // the request is on the wire
    {
        Client lost = connect();
        lost.send(raw_put("k"));
        while (bus.requests.empty()) io.run_one();
    }
    while (bus.cancelled.empty()) io.run_one();
    EXPECT_EQ(put("k").status(), 409u);
    bus.release(answer_from_addresses(bus.requests[0]));
    io.poll();
    const Reply again = put("k");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "true");
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiKeyed, P2WhoLeavesTakesWhatWaitsAlongAndMayTryAgain) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    {
        Client lost = connect();
        lost.send(raw_put("k"));
        while (bus.requests.empty()) io.run_one();
    }
    while (bus.cancelled.empty()) io.run_one();
    io.poll();
    bus.script = [](const bus::Request& request) { return answer_from_addresses(request); };
    const Reply again = put("k");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "");
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiKeyed, KeysBelongToTheTokenThatBringsThem) {
    settings.tokens.push_back({"ops", Role::operator_, "let-me"});
    put("k");
    const Reply other = put("k", R"({"values":[8]})", "Authorization: Bearer let-me\r\n");
    EXPECT_EQ(other.status(), 200u);
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiKeyed, AServerThatEndsLeavesNobodyWorking) {
    bus.script = [](const bus::Request&) { return std::nullopt; };
    Client client = connect();
    client.send(raw_put("k"));
    while (bus.requests.empty()) io.run_one();
    server.reset();
    bus.release(answer_from_addresses(bus.requests[0]));
    io.poll();
    EXPECT_FALSE(bus.cancelled.empty());
}

TEST_F(ApiKeyed, SaysWhatAKeyIs) {
    for (const char* key : {"\"\"", "a b", "\"a\"b\"", "\xc3\xa4"}) {
        const Reply reply = put(key);
        EXPECT_EQ(reply.status(), 400u) << key;
        EXPECT_THAT(std::string(reply.at("detail").as_string()), HasSubstr("1 to 255"));
    }
    EXPECT_EQ(put(std::string(256, 'k')).status(), 400u);
    EXPECT_EQ(put("k\r\nIdempotency-Key: l").status(), 400u);
    EXPECT_EQ(put(std::string(255, 'k')).status(), 200u);
}

TEST_F(ApiKeyed, ReadsHaveNone) {
    for (int i = 0; i < 2; ++i)
        ask("GET", "/api/v1/stations/press/coils/1", "", "Idempotency-Key: k\r\n");
    EXPECT_EQ(bus.requests.size(), 2u);
}

}  // namespace
}  // namespace panelgate::web::keyed_test
