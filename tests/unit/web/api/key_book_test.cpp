#include "key_book.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "http_rig.hpp"

namespace panelgate::web::key_book_test {
namespace {

using ::testing::HasSubstr;

class Keys : public ::testing::Test {
  protected:
    enum class Outcome { fresh, answer, in_flight, other, full };
    using enum Outcome;
    Outcome begin(const std::string& client, const std::string& key, std::uint64_t request = 1) {
        const auto begun = book.begin(now, {client, key}, request, std::make_shared<Caller>(1, ""));
        if (std::holds_alternative<KeyBook::Fresh>(begun)) return fresh;
        const auto* refused = std::get_if<Problem>(&begun);
        if (refused == nullptr) return answer;
        if (refused->status == 409) return in_flight;
        return refused->status == 422 ? other : full;
    }
    void end(const std::string& client, const std::string& key) {
        HttpResponse made;
        made.body = "1234567890";
        book.end(now, {client, key}, made);
    }

    ApiSettings settings{
        .keys_kept = 10min, .max_keys = 4, .max_keys_of_client = 3, .max_kept = 25};
    KeyBook book{settings};
    TimePoint now{1h};
};

TEST_F(Keys, AreForgottenWhenTheirTimeIsOverAndNotBefore) {
    EXPECT_EQ(begin("a", "k"), fresh);
    EXPECT_EQ(begin("a", "k"), in_flight);
    EXPECT_EQ(begin("b", "k"), fresh) << "another client";
    end("a", "k");
    now += 10min - 1ns;
    EXPECT_EQ(begin("a", "k"), answer);
    EXPECT_EQ(begin("a", "k", 2), other);
    now += 1ns;
    EXPECT_EQ(begin("a", "k", 2), fresh);
    EXPECT_EQ(book.size(), 2u);
    book.drop({"a", "k"});
    EXPECT_EQ(begin("a", "k", 3), fresh) << "what had no effect may be tried again";
}

TEST_F(Keys, OfOneClientLeaveRoomForOthers) {
    for (const char* key : {"1", "2", "3"}) EXPECT_EQ(begin("a", key), fresh);
    EXPECT_EQ(begin("a", "4"), full);
    EXPECT_EQ(begin("b", "4"), fresh);
    EXPECT_EQ(begin("c", "4"), full);
    book.drop({"a", "1"});
    EXPECT_EQ(begin("c", "4"), fresh);
}

TEST_F(Keys, AreBoundedByTheBytesOfTheirAnswersToo) {
    for (const char* key : {"1", "2", "3"}) begin("a", key), end("a", key);
    EXPECT_EQ(begin("b", "4"), full);
    now += 10min;
    EXPECT_EQ(begin("b", "4"), fresh);
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
        return ask("PUT", kPath, body, "Idempotency-Key: " + key + "\r\n" + more);
    }
    static std::string put_text() {
        return http_text("PUT", kPath, "Idempotency-Key: k\r\nContent-Length: 14\r\n") +
               R"({"values":[9]})";
    }
    static bool is_replayed(const Reply& reply) {
        return reply.header("Idempotency-Replayed") == "true";
    }
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
}  // namespace panelgate::web::key_book_test
