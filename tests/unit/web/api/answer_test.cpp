#include "answer.hpp"

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>

#include "support/fake_bus.hpp"

namespace panelgate::web::answer_test {
namespace {

boost::json::object told(const Problem& problem) {
    return boost::json::parse(to_response(problem).body).as_object();
}

TEST(Answer, TellsAFaultWithTheExceptionThatModbusClientsGetAndWhetherItLeft) {
    const auto object = told(problem_of(Fault::timeout, true));
    EXPECT_EQ(object.at("type"), "urn:panelgate:problem:timeout");
    EXPECT_EQ(object.at("status"), 504);
    EXPECT_EQ(object.at("modbus_exception"), 11);
    EXPECT_EQ(object.at("transmitted"), true);
}

TEST(Answer, NeverSoundsAsIfSomethingWasSentThatWasNot) {
    for (const Fault fault : {Fault::timeout, Fault::damaged, Fault::offline}) {
        EXPECT_TRUE(problem_of(fault, false).detail.starts_with("nothing was sent: "));
        EXPECT_FALSE(problem_of(fault, true).detail.starts_with("nothing was sent"));
    }
}

TEST(Answer, AsksToTryAgainOnlyWhereThatMayHelp) {
    ASSERT_EQ(problem_of(Fault::busy, false).headers.size(), 1u);
    EXPECT_EQ(problem_of(Fault::busy, false).headers[0].first, "Retry-After");
    EXPECT_TRUE(problem_of(Fault::timeout, true).headers.empty());
    EXPECT_TRUE(problem_of(Fault::line_down, false).headers.empty());
}

TEST(Answer, AddsTheManualsWordToAnException) {
    profile::PanelProfile panel;
    panel.exceptions.push_back({2, "Address is outside the range"});
    const Problem known = problem_of_exception(2, panel);
    EXPECT_EQ(known.status, 422u);
    EXPECT_TRUE(known.detail.starts_with("the panel answered exception 2: ")) << known.detail;
    EXPECT_TRUE(known.detail.ends_with(" (Address is outside the range)")) << known.detail;
    EXPECT_FALSE(problem_of_exception(3, panel).detail.ends_with(")"));
    EXPECT_EQ(told(known).at("modbus_exception"), 2);
}

TEST(Answer, BlamesTheRequestForExceptionsOneToFourOnly) {
    EXPECT_EQ(problem_of_exception(1, {}).status, 422u);
    EXPECT_EQ(problem_of_exception(4, {}).status, 422u);
    EXPECT_EQ(problem_of_exception(0, {}).status, 502u);
    EXPECT_EQ(problem_of_exception(5, {}).status, 502u);
}

TEST(Answer, TellsWhatTheRightsForbid) {
    bus::Answer refused = test::FakeBus::fault(Fault::denied, false);
    refused.refusal = bus::Refusal{bus::Rule::read_only, "meter"};
    const Problem problem = problem_of(refused);
    EXPECT_EQ(problem.status, 403u);
    EXPECT_EQ(problem.detail, "refused here, nothing was sent: station 'meter' is read-only");
    EXPECT_EQ(told(problem).at("type"), "urn:panelgate:problem:refused");
    EXPECT_EQ(told(problem).at("rule"), "access");
    EXPECT_EQ(told(problem).at("transmitted"), false);
    EXPECT_EQ(problem_of(refused, {}).value().detail, problem.detail);
    refused.refusal->rule = bus::Rule::broadcast_over_read_only;
    EXPECT_EQ(problem_of(refused).detail,
              "refused here, nothing was sent: a broadcast would write to station 'meter', which "
              "is read-only");
}

TEST(Answer, OfAGuardSaysThatItWasRefusedHereAndByWhichRule) {
    bus::Answer guarded = test::FakeBus::reply({0x86, 2});
    guarded.transmitted = false;
    guarded.refusal =
        bus::Refusal{bus::Rule::range, "oven", modbus::ExceptionCode::illegal_data_address,
                     "coils 9 is no memory of x"};
    const Problem problem = problem_of(guarded, {}).value();
    EXPECT_EQ(problem.status, 422u);
    EXPECT_EQ(problem.detail,
              "refused here, nothing was sent: the guard of station 'oven' refuses it: coils 9 is "
              "no memory of x");
    EXPECT_EQ(told(problem).at("type"), "urn:panelgate:problem:refused");
    EXPECT_EQ(told(problem).at("rule"), "range");
    EXPECT_EQ(told(problem).at("modbus_exception"), 2);
    EXPECT_EQ(told(problem).at("transmitted"), false);
}

TEST(Answer, OfALineThatIsDownSaysWhatIsWrongWithIt) {
    bus::Answer down = test::FakeBus::fault(Fault::line_down, false);
    EXPECT_EQ(problem_of(down).detail, "the line is down");
    down.why = "cannot open /dev/ttyS0: Permission denied";
    const Problem problem = problem_of(down);
    EXPECT_EQ(problem.status, 502u);
    EXPECT_EQ(problem.detail, "the line is down: cannot open /dev/ttyS0: Permission denied");
}

TEST(Answer, OfABroadcastSaysThatNobodyHasConfirmedIt) {
    const auto sent = broadcast_answer(test::FakeBus::reply({6, 0, 1, 0, 2}));
    EXPECT_EQ(sent.status, 202u);
    EXPECT_EQ(sent.body, "{\"transmitted\":true,\"confirmed\":false}\n");
    EXPECT_EQ(broadcast_answer(test::FakeBus::fault(Fault::busy, false)).status, 503u);
}

TEST(Answer, RoundsMillisecondsTowardsZero) {
    EXPECT_EQ(whole_ms(1'999'999ns), 1);
    EXPECT_EQ(whole_ms(-1'999'999ns), -1);
}

TEST(Answer, WritesBytesInCapitals) {
    const Bytes bytes{0x1f, 0x01, 0xff};
    EXPECT_EQ(upper_hex(bytes), "1F 01 FF");
    EXPECT_EQ(upper_hex(bytes, ""), "1F01FF");
}

}  // namespace
}  // namespace panelgate::web::answer_test
