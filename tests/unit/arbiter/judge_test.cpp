// The table: what is done with a frame of which these facts are true.
#include "panelgate/arbiter/judge.hpp"

#include <gtest/gtest.h>

#include <cstddef>

namespace panelgate::arbiter::judge_test {
namespace {

using namespace fact;

struct Row {
    Facts facts;
    Done done;
};

template <std::size_t kRows>
void expect(const Row (&rows)[kRows]) {
    for (const Row& row : rows) EXPECT_EQ(judge(row.facts), row.done) << row.facts;
}

TEST(Judge, P1AReplyInTheFormOfTheOpenRequestIsAcceptedWhateverElseMayBeTrueOfTheFrame) {  // T7
    const Facts may_be_true[] = {0, own_frame, request, broadcast, copy, outstanding, last_form};
    for (const Facts also : may_be_true) EXPECT_EQ(judge(answers | known | also), Done::accept);
}

TEST(Judge, P1T2ALateReplyClosesItsRequest) {
    expect({{outstanding | known, Done::late},
            {outstanding | known | last_form, Done::late},
            {outstanding | known | broadcast, Done::late}});
}

TEST(Judge, P1T2AnExceptionThatAnOlderRequestMayHaveHadIsTheOlderRequests) {
    expect({{answers | refuses_older | outstanding | known, Done::late}});
}

TEST(Judge, T3DamageIsCounted) {
    expect({{damaged, Done::damaged}, {damaged | request, Done::request}});
}

TEST(Judge, T5AFrameOfAStationThatWasNeverAskedIsNobodys) { expect({{0, Done::nobodys}}); }

TEST(Judge, P8T6OurOwnFrameIsNoReplyBeforeItsEcho) {
    expect({{answers | own_echo | known, Done::echo},
            {answers | own_echo | own_frame | known, Done::echo},
            {own_frame | known, Done::echo},
            {own_frame | request, Done::echo},
            {own_frame | damaged, Done::echo}});
}

TEST(Judge, P1T9AReplyThatMayBeAnotherMastersIsContestedOrNobodys) {
    expect({{answers | other_master | known, Done::contested},
            {answers | other_master | own_echo | refuses_older, Done::contested},
            {other_master | known, Done::nobodys},
            {other_master | outstanding | copy | known, Done::nobodys},
            {request | known, Done::request}});
}

TEST(Judge, T11AnAnswerToABroadcastConfirmsNothing) {
    expect({{broadcast, Done::broadcast},
            {broadcast | known | last_form, Done::broadcast},
            {broadcast | known | copy, Done::copy}});
}

TEST(Judge, T12TheLastReplyOnceMoreIsACopy) {
    expect({{copy | known, Done::copy}, {copy | outstanding | last_form | known, Done::copy}});
}

TEST(Judge, T13TheFormOfTheLastReplyIsASecondPanelsAndAnyOtherFrameIsWrong) {
    expect({{last_form | known, Done::second}, {known, Done::wrong}});
}

}  // namespace
}  // namespace panelgate::arbiter::judge_test
