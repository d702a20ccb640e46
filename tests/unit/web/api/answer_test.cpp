#include "answer.hpp"

#include <gtest/gtest.h>

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/web/api/render.hpp"
#include "support/fake_bus.hpp"

namespace panelgate::web::answer_test {
namespace {

using Headers = std::vector<std::pair<std::string, std::string>>;

boost::json::object told(const Problem& problem) {
    return boost::json::parse(to_response(problem).body).as_object();
}

TEST(Answer, OfAFaultHasItsStatusItsExceptionAndWhetherItLeft) {
    struct Row {
        Fault fault;
        bool transmitted;
        unsigned status;
        int exception;  ///< that Modbus clients get
    };
    constexpr Row kRows[] = {
        {Fault::denied, false, 403, 1},      {Fault::malformed, false, 400, 3},
        {Fault::not_routed, false, 404, 10}, {Fault::busy, false, 503, 6},
        {Fault::expired, false, 503, 6},     {Fault::line_down, false, 502, 10},
        {Fault::line_lost, true, 502, 11},   {Fault::timeout, true, 504, 11},
        {Fault::damaged, true, 502, 11},     {Fault::offline, false, 504, 11},
        {Fault::cancelled, false, 503, 10},  {Fault::wrong, true, 502, 11},
    };
    for (const Row& row : kRows) {
        SCOPED_TRACE(label(row.fault));
        const Problem problem = problem_of(row.fault, row.transmitted);
        const Headers later = row.status == 503 ? Headers{{"Retry-After", "1"}} : Headers{};
        EXPECT_EQ(problem.headers, later);
        const auto object = told(problem);
        EXPECT_EQ(object.at("type").as_string(),
                  "urn:panelgate:problem:" + std::string(label(row.fault)));
        EXPECT_EQ(object.at("status"), row.status);
        EXPECT_EQ(object.at("modbus_exception"), row.exception);
        EXPECT_EQ(object.at("transmitted"), row.transmitted);
    }
    for (const Fault fault : {Fault::timeout, Fault::damaged, Fault::offline, Fault::wrong}) {
        EXPECT_TRUE(problem_of(fault, false).detail.starts_with("nothing was sent: "));
        EXPECT_FALSE(problem_of(fault, true).detail.starts_with("nothing was sent"));
    }
}

TEST(Answer, OfAnExceptionBlamesTheRequestForOneToFourOnlyAndAddsTheManualsWord) {
    profile::PanelProfile panel;
    panel.exceptions.push_back({2, "Address is outside the range"});
    const auto problem_of_code = [&](unsigned code) {
        const auto byte = static_cast<std::uint8_t>(code);
        return problem_of(test::FakeBus::reply({0x83, byte}), panel).value();
    };
    for (unsigned code = 0; code <= 11; ++code) {
        const Problem problem = problem_of_code(code);
        EXPECT_EQ(problem.status, code >= 1 && code <= 4 ? 422u : 502u) << code;
        EXPECT_EQ(told(problem).at("modbus_exception"), code);
        EXPECT_EQ(problem.detail.ends_with(" (Address is outside the range)"), code == 2) << code;
    }
    EXPECT_EQ(
        problem_of_code(2).detail,
        "the panel answered exception 2: illegal data address (Address is outside the range)");
}

TEST(Answer, OfARefusalSaysThatNothingWasSentAndByWhichRule) {
    struct Row {
        bus::Refusal refusal;
        unsigned status;
        const char* rule;
        const char* detail;
    };
    const Row rows[] = {
        {{bus::Rule::read_only, "meter"}, 403, "access", "station 'meter' is read-only"},
        {{bus::Rule::broadcast_over_read_only, "meter"},
         403,
         "access",
         "a broadcast would write to station 'meter', which is read-only"},
        {{bus::Rule::range, "oven", modbus::ExceptionCode::illegal_data_address,
          "coils 9 is no memory of x"},
         422,
         "range",
         "the guard of station 'oven' refuses it: coils 9 is no memory of x"},
    };
    for (const Row& row : rows) {
        bus::Answer answer = test::FakeBus::reply({0x86, 2});
        answer.transmitted = false;
        answer.refusal = row.refusal;
        const Problem problem = problem_of(answer);
        EXPECT_EQ(problem.status, row.status);
        EXPECT_EQ(problem.detail, std::string("refused here, nothing was sent: ") + row.detail);
        EXPECT_EQ(problem_of(answer, {}).value().detail, problem.detail);
        EXPECT_EQ(told(problem).at("type"), "urn:panelgate:problem:refused");
        EXPECT_EQ(told(problem).at("rule"), row.rule);
        EXPECT_EQ(told(problem).at("modbus_exception"), row.status == 403 ? 1 : 2);
        EXPECT_EQ(told(problem).at("transmitted"), false);
    }
}

TEST(Answer, OfALineThatIsDownSaysWhatIsWrongWithIt) {
    bus::Answer down = test::FakeBus::fault(Fault::line_down, false);
    EXPECT_EQ(problem_of(down).detail, "the line is down");
    down.why = "cannot open /dev/ttyS0: Permission denied";
    EXPECT_EQ(problem_of(down).status, 502u);
    EXPECT_EQ(problem_of(down).detail,
              "the line is down: cannot open /dev/ttyS0: Permission denied");
}

TEST(Csv, IsForWhoNamesItAndNoJsonBefore) {
    for (const char* accept : {"text/csv", "text/csv, */*;q=0.1", "text/csv, application/json"})
        EXPECT_TRUE(wants_csv(accept)) << accept;
    for (const char* accept : {"", "*/*", "application/json, text/csv;q=0.8"})
        EXPECT_FALSE(wants_csv(accept)) << accept;
}

TEST(Csv, QuotesWhatHasCommasQuotesOrLines) {
    constexpr std::string_view columns[] = {"a", "b,c", "d", "e", "f"};
    EXPECT_EQ(csv_line(columns), "a,\"b,c\",d,e,f\r\n");
    const auto object =
        boost::json::parse(R"({"a":"x \"y\"","b,c":1.5,"d":null,"e":true})").as_object();
    EXPECT_EQ(csv_line(object, columns), "\"x \"\"y\"\"\",1.5,,true,\r\n");
}

TEST(Csv, ATextOfAPanelIsNoFormulaAndSteersNoTerminal) {
    constexpr std::string_view columns[] = {"a", "b", "c", "d"};
    const auto line = [&](const char* object) {
        return csv_line(boost::json::parse(object).as_object(), columns);
    };
    EXPECT_EQ(line(R"({"a":"=1+1","b":"+1","c":"-x","d":"@x"})"), "'=1+1,'+1,'-x,'@x\r\n");
    EXPECT_EQ(line(R"({"a":"\u001b[2J","b":"\u0007","c":"a\nb\rc","d":"\t=1"})"),
              "?[2J,?,a?b?c,?=1\r\n");
    EXPECT_EQ(line(R"({"a":-1,"b":-1.5,"c":"a=1","d":null})"), "-1,-1.5,a=1,\r\n");
}

}  // namespace
}  // namespace panelgate::web::answer_test
