#include <string>

#include "http_rig.hpp"

namespace panelgate::web::once_test {
namespace {

using ::testing::HasSubstr;

class ApiKeyed : public HttpRig {
  protected:
    Reply put(const std::string& key, const std::string& body = kBody,
              const std::string& more = "") {
        return ask("PUT", kPath, body, "Idempotency-Key: " + key + "\r\n" + more);
    }
    static std::string put_text() {
        return http_text("PUT", kPath, "Idempotency-Key: k\r\nContent-Length: 14\r\n") +
               R"({"values":[9]})";
    }
    static bool is_replayed(const Reply& reply) {
        return reply.header("Idempotency-Replayed") == "true";
    }
    static constexpr const char* kBody = R"({"values":[9]})";
    static constexpr const char* kPath = "/api/v1/stations/press/devices/UW7";
};

TEST_F(ApiKeyed, P2ARepeatedWriteGetsTheFirstAnswerAndGoesOutOnce) {
    const Reply first = put("\"a-1\"");
    EXPECT_EQ(first.status(), 200u);
    EXPECT_EQ(first.header("Idempotency-Replayed"), "");
    const Reply again = put("a-1");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_EQ(again.body(), first.body());
    EXPECT_TRUE(is_replayed(again));
    EXPECT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(put("a-2").status(), 200u);
    EXPECT_EQ(bus.requests.size(), 2u);
    now += 10min;
    EXPECT_EQ(put("a-1").status(), 200u);
    EXPECT_EQ(bus.requests.size(), 3u);
}

TEST_F(ApiKeyed, P2AnUnknownOutcomeIsRememberedTooAndWhatNeverLeftMayBeTriedAgain) {
    answer_with(Fault::timeout, true);
    EXPECT_EQ(put("k").status(), 504u);
    answer_normally();
    EXPECT_EQ(put("k").status(), 504u);
    EXPECT_EQ(bus.requests.size(), 1u);
    answer_with(Fault::busy, false);
    EXPECT_EQ(put("l").status(), 503u);
    EXPECT_EQ(put("l", "{").status(), 400u);
    answer_normally();
    EXPECT_EQ(put("l").status(), 200u);
}

TEST_F(ApiKeyed, AnotherRequestWithTheSameKeyIsRefusedUnlessItBringsAnotherToken) {
    settings.tokens.push_back({"ops", Role::operator_, hash_of("let-me")});
    put("k");
    EXPECT_EQ(status_and(put("k", R"({"values":[8]})"), "detail"),
              "422 this Idempotency-Key was that of another request");
    EXPECT_EQ(bus.requests.size(), 1u);
    const char* token = "Authorization: Bearer let-me\r\n";
    EXPECT_EQ(put("k", R"({"values":[8]})", token).status(), 200u);
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiKeyed, AKeyUnderWayIsAConflict) {
    hold_answers();
    Client first = connect();
    begin(first, put_text());
    const Reply second = put("k");
    EXPECT_EQ(status_and(second, "title"), "409 Conflict");
    EXPECT_EQ(second.header("Retry-After"), "1");
    bus.release(answer_from_addresses(bus.requests[0]));
    EXPECT_EQ(first.receive().status(), 200u);
}

TEST_F(ApiKeyed, P2WhoComesBackForALostAnswerGetsIt) {
    hold_answers();
    bus.completes_on_cancel = false;  // the request is on the wire
    ask_and_leave(put_text());
    while (bus.cancelled.empty()) io.run_one();
    EXPECT_EQ(put("k").status(), 409u);
    bus.release(answer_from_addresses(bus.requests[0]));
    io.poll();
    const Reply again = put("k");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_TRUE(is_replayed(again));
    EXPECT_EQ(bus.requests.size(), 1u);
}

TEST_F(ApiKeyed, P2WhoLeavesTakesWhatWaitsAlongAndMayTryAgain) {
    hold_answers();
    ask_and_leave(put_text());
    while (bus.cancelled.empty()) io.run_one();
    io.poll();
    answer_normally();
    const Reply again = put("k");
    EXPECT_EQ(again.status(), 200u);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "");
    EXPECT_EQ(bus.requests.size(), 2u);
}

TEST_F(ApiKeyed, OfFewClientsLeaveRoomForOthersAndNoneIsDroppedBeforeItsTime) {
    api.max_keys = 64;
    std::vector<std::string> tokens;
    for (const char* name : {"a", "b", "c", "d"}) {
        settings.tokens.push_back({name, Role::operator_, hash_of(name)});
        tokens.push_back("Authorization: Bearer " + std::string(name) + "\r\n");
    }
    for (const std::string& token : tokens) {
        int kept = 0;
        while (put(std::to_string(kept), kBody, token.c_str()).status() == 200u) ++kept;
        EXPECT_GE(kept, 5);
        EXPECT_LE(kept, 16);
    }
    EXPECT_EQ(put("0").status(), 200u) << "a client that had none";
    EXPECT_TRUE(is_replayed(put("0", kBody, tokens[0].c_str())));
    const Reply refused = put("99", kBody, tokens[0].c_str());
    EXPECT_EQ(refused.status(), 503u);
    EXPECT_NE(refused.header("Retry-After"), "");
    now += 10min;
    EXPECT_EQ(put("99", kBody, tokens[0].c_str()).status(), 200u);
}

TEST_F(ApiKeyed, AreBoundedByTheBytesOfTheirAnswersToo) {
    api.max_kept = 1;
    EXPECT_EQ(put("1").status(), 200u);
    EXPECT_EQ(put("2").status(), 503u);
    now += 10min;
    EXPECT_EQ(put("2").status(), 200u);
}

TEST_F(ApiKeyed, AServerThatEndsLeavesNobodyWorking) {
    hold_answers();
    Client client = connect();
    begin(client, put_text());
    server.reset();
    bus.release(answer_from_addresses(bus.requests[0]));
    io.poll();
    EXPECT_FALSE(bus.cancelled.empty());
}

TEST_F(ApiKeyed, SaysWhatAKeyIs) {
    for (const char* key : {"\"\"", "a b", "\"a\"b\"", "\xc3\xa4"}) {
        const Reply reply = put(key);
        EXPECT_EQ(reply.status(), 400u) << key;
        EXPECT_THAT(detail_of(reply), HasSubstr("1 to 255"));
    }
    EXPECT_EQ(put(std::string(256, 'k')).status(), 400u);
    EXPECT_EQ(put("k\r\nIdempotency-Key: l").status(), 400u);
    EXPECT_EQ(put(std::string(255, 'k')).status(), 200u);
    bus.requests.clear();
    for (int i = 0; i < 2; ++i)
        ask("GET", "/api/v1/stations/press/coils/1", "", "Idempotency-Key: k\r\n");
    EXPECT_EQ(bus.requests.size(), 2u) << "reads have none";
}

}  // namespace
}  // namespace panelgate::web::once_test
