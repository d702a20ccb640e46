#include "client_names.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace panelgate::bus::explain_test {
namespace {

using arbiter::Decision;
using arbiter::Reason;

const ClientName kScada = std::make_shared<const std::string>("modbus_tcp 10.0.0.5:50012");

TEST(Explain, TellsWhyAFrameIsSent) {
    Reason reason{.kind = Reason::Kind::turn, .station = 17, .waited = 1500us, .waiting = 2};
    EXPECT_EQ(text_of(reason, kScada),
              "read of modbus_tcp 10.0.0.5:50012 to station 17: next in turn after 1.5 ms, 2 wait");
    reason.passed_over = true;
    reason.answers = 3;
    reason.asked_function = 6;
    EXPECT_EQ(text_of(reason, nullptr),
              "read of a client without a name to station 17: next in turn after 1.5 ms, 2 wait, "
              "ahead of a higher class that has had its turns, answers 3 requests in one, instead "
              "of function 6");
    reason = {.kind = Reason::Kind::again, .priority = PriorityClass::poll, .attempt = 2};
    EXPECT_EQ(text_of(reason, std::make_shared<const std::string>("poll of oven")),
              "poll of oven: attempt 2");
    EXPECT_EQ(text_of(Reason{}, kScada), "");
}

TEST(Explain, TellsWhatIsDecided) {
    struct Row {
        Decision::Kind kind;
        std::string text;
    };
    const std::string read = "read of modbus_tcp 10.0.0.5:50012 to station 17 ";
    const Row rows[] = {
        {Decision::Kind::offline,
         read + "refused: offline after 3 silent transactions, next probe in 500.0 ms"},
        {Decision::Kind::full,
         read + "refused: 3 of 256 wait on this line, at most 32 of one client"},
        {Decision::Kind::shed,
         read + "given up: the queue is full, and its host has the most waiting"},
        {Decision::Kind::expired,
         read + "given up after 500.0 ms: it could not end before its deadline"},
        {Decision::Kind::unanswered,
         read + "given up after 500.0 ms: no answer before its deadline"},
        {Decision::Kind::condition,
         "station 17 is failing now: no retries, and with other suspects a fifth of the line's "
         "time at most"},
        {Decision::Kind::line_rests,
         "only this request is sent for 500.0 ms: station 17 did not answer and may do so late"},
    };
    for (const Row& row : rows) {
        const Decision decision{.at = {},
                                .kind = row.kind,
                                .station = 17,
                                .time = 500ms,
                                .count = 3,
                                .condition = Condition::failing};
        EXPECT_EQ(text_of(decision, kScada, {}), row.text);
    }
}

}  // namespace
}  // namespace panelgate::bus::explain_test
