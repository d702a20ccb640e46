#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::station_test {
namespace {

using test::group_of;

constexpr std::uint8_t kId = 17;
constexpr Duration kTimeout = 500ms;
const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kOther = "03 00 00 00 01"_hex;
const Bytes kLong = "03 00 00 00 03"_hex;
const Bytes kWrite = "06 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;
const Bytes kOtherValue = "03 02 02 2C"_hex;
const Bytes kThirdValue = "03 02 02 2D"_hex;
const Bytes kLongReply = "03 06 00 01 00 02 00 03"_hex;

Station station(bool listed) {
    StationSettings settings;
    settings.id = kId;
    return {settings, OfflineSettings{}, listed};
}

class StationTest : public testing::Test {
  protected:
    /// A request left 30 ms ago, and this answers it now.
    void answer(Group group, const Bytes& reply) {
        now_ += 1s;
        const auto attempt = test::answered(now_ - 30ms, now_, std::move(group), reply);
        station_.on_reply(book_, now_, attempt, 30ms, 25ms);
    }
    void answer(const Bytes& request, const Bytes& reply) { answer(group_of(kId, request), reply); }
    /// A request was not answered.
    void miss(const Bytes& request, Verdict verdict = Verdict::silent) {
        const TimePoint sent = now_;
        now_ += kTimeout;
        station_.on_failed(now_, verdict, kTimeout);
        station_.replies().on_unanswered(book_, now_, request, sent);
    }
    /// This request is sent, for the first time or again.
    bool may_ask(TimePoint now, const Bytes& pdu) const {
        return now >= station_.replies().clear_at(book_, test::request_of(pdu), true);
    }
    Duration patience(const Bytes& request) const {
        return station_.patience(group_of(kId, request), std::nullopt, false);
    }

    struct Heard : Station::Heard {
        Done done = Done::unasked;
    };
    /// A good frame comes that answers no open request; `asked`: one is on the wire.
    Heard hear(TimePoint now, const Bytes& pdu, bool asked = false) {
        const Done done = judged(now, pdu);
        if (is_late(done)) station_.on_sign_of_life(now);
        return {station_.on_unsolicited_frame(book_, now, done, pdu, asked), done};
    }
    /// It may answer an earlier request that is closed, rather than the open one.
    bool may_have_passed(const Bytes& pdu, const Bytes& open) const {
        const OutstandingRequests::Windows all;
        return book_.claims(now_, kId, pdu, all, open).passed;
    }
    Done judged(TimePoint now, const Bytes& pdu) const {
        return judge(station_.replies().facts(book_, now, pdu));
    }

    OutstandingRequests book_;
    Station station_ = station(true);
    TimePoint now_{1h};
};

TEST_F(StationTest, AnAdaptiveTimeoutFollowsTheTurnaroundBetweenFloorAndWhatIsConfigured) {
    StationSettings settings = station_.settings();
    settings.adaptive_timeout = true;
    station_.apply(settings, {}, true);
    EXPECT_EQ(station_.response_timeout(), kTimeout) << "nothing is known yet";
    for (int i = 0; i < 10; ++i) answer(kRead, kReply);
    const Duration wanted = settings.timeout_floor + 25ms + 30ms;
    EXPECT_EQ(station_.response_timeout(), wanted);
    EXPECT_EQ(patience(kRead), station_.response_timeout());
    EXPECT_EQ(patience(kWrite), kTimeout) << "only its reply shows whether it was executed";
    miss(kRead);
    EXPECT_EQ(station_.response_timeout(), 2 * wanted);
    for (int i = 0; i < 100; ++i) miss(kRead);
    EXPECT_EQ(station_.response_timeout(), kTimeout);
    answer(kRead, kReply);
    EXPECT_EQ(station_.response_timeout(), wanted);
}

TEST_F(StationTest, P1WithAnOutstandingReplyOnlyTheVerySameMayBeAskedUntilItHasRested) {
    EXPECT_TRUE(may_ask(now_, kOther));
    miss(kRead);
    const TimePoint rested = station_.replies().rested();
    EXPECT_GE(rested, now_ + kTimeout) << "so much later it may still come";
    EXPECT_TRUE(may_ask(now_, kRead));
    EXPECT_FALSE(may_ask(rested - 1ns, kOther));
    station_.on_asked(book_, rested - 1ns, group_of(kId, kRead));
    EXPECT_TRUE(book_.any(kId));
    EXPECT_TRUE(may_ask(rested, kOther));
    station_.on_asked(book_, rested, group_of(kId, kOther));
    EXPECT_FALSE(book_.any(kId)) << "it has lapsed";
}

TEST_F(StationTest, P1EachAttemptHasAnOutstandingReplyAndTheLastOneThatComesEndsTheRest) {
    miss(kRead);
    miss(kRead);
    answer(group_of(kId, kRead, 3), kReply);  // to which of the three is unknown
    const auto first = hear(now_ + 10ms, kOtherValue);
    EXPECT_EQ(first.done, Done::late);
    EXPECT_EQ(first.lateness, Duration(0)) << "what can no longer come makes no other look late";
    EXPECT_FALSE(first.settled);
    EXPECT_FALSE(may_ask(now_ + 10ms, kOther));
    const auto second = hear(now_ + 20ms, kThirdValue);
    EXPECT_EQ(second.done, Done::late);
    EXPECT_TRUE(second.settled);
    EXPECT_FALSE(book_.any(kId));
    EXPECT_TRUE(may_ask(now_ + 20ms, kOther));
}

TEST_F(StationTest, P4ARefusalThatMayBeMeantForTheOpenRequestShowsNoNeed) {
    answer(kRead, kReply);
    station_.replies().on_unanswered(book_, now_, kRead, now_);
    hear(now_ + 100ms, "83 02"_hex, true);
    EXPECT_EQ(station_.slowest(), 30ms);
}

/// It may be the damaged reply resent: then the reply to the retry still comes.
TEST_F(StationTest, P1AfterADamagedReplyTheRetrysReplyOfAStationThatWasEverLateIsOutstanding) {
    const auto repeat = [&] {
        now_ += 2s;
        station_.on_asked(book_, now_, group_of(kId, kRead));
        station_.replies().on_damaged_reply(book_, now_, test::request_of(kRead), now_ - 30ms);
        now_ += 60ms;
        const auto attempt =
            test::answered(now_ - 30ms, now_, group_of(kId, kRead, 2), kOtherValue);
        station_.on_reply(book_, now_, attempt, 30ms, 25ms);
    };
    repeat();
    EXPECT_TRUE(may_ask(now_ + 150ms, kOther)) << "it has never been late";
    miss(kRead);
    hear(now_ + 50ms, kReply);
    EXPECT_EQ(station_.replies().worst_lateness(), Duration(0)) << "it was, once";
    repeat();
    EXPECT_TRUE(book_.any(kId));
    EXPECT_FALSE(may_ask(now_ + kTimeout, kOther));
}

TEST_F(StationTest, P1ARepetitionOfThePreviousReplyMayBeADuplicateAndTheOutstandingOneStillComes) {
    miss(kRead);
    answer(group_of(kId, kRead, 2), kReply);
    const auto same = hear(now_ + 20ms, kReply);
    EXPECT_EQ(same.done, Done::late) << "as a rule";
    EXPECT_FALSE(same.settled);
    EXPECT_TRUE(book_.any(kId));
    const auto other = hear(now_ + 40ms, kOtherValue);
    EXPECT_TRUE(other.settled);
    EXPECT_TRUE(may_ask(now_ + 40ms, kOther)) << "duplicates are not its habit yet";
}

TEST_F(StationTest, P1ADuplicateAmidDamagedBytesShowsThatTheStationSendsTwice) {
    answer(kRead, kReply);
    const Bytes adu = modbus::encode_adu(kId, kReply);
    const Bytes heard = Writer().raw("23 03"_hex).raw(adu).u8(7).take();
    station_.replies().on_damaged_bytes(book_, now_ + 20ms, heard, modbus::CrcOrder::low_first);
    answer(kOther, kOtherValue);
    EXPECT_FALSE(may_ask(now_ + 20ms, kOther));
    EXPECT_TRUE(may_ask(now_ + 100ms, kOther));
}

TEST_F(StationTest, P1ADuplicateDetectedAfterTheReplyThatItPrecededMakesTheStationRestAllTheSame) {
    answer(kRead, kReply);
    answer(kOther, kOtherValue);
    EXPECT_TRUE(may_ask(now_ + 10ms, kRead));
    hear(now_ + 20ms, kOtherValue);
    EXPECT_FALSE(may_ask(now_ + 20ms, kRead));
}

TEST_F(StationTest, P1WhereTheLineMayStallOnlyALaterRequestThatWasAnsweredProvesThatOneHasPassed) {
    const TimePoint sent = now_;
    miss(kRead);
    EXPECT_TRUE(book_.any_since(kId, TimePoint{}));
    EXPECT_TRUE(book_.any_since(kId, sent));
    EXPECT_FALSE(book_.any_since(kId, sent + 1ns));
    const TimePoint rested = station_.replies().rested();
    now_ = rested + 1h;
    station_.replies().on_proved(book_, now_, sent - 1ns);
    EXPECT_EQ(station_.replies().rested(), rested) << "that one had left before";
    station_.replies().on_proved(book_, now_, sent + 1ns);
    EXPECT_GE(station_.replies().rested(), now_ + kTimeout)
        << "it may have reached the station only now";
}

TEST_F(StationTest, P5AReplyThatCameDamagedIsNotOutstandingButSomeResendIt) {
    station_.replies().on_damaged_reply(book_, now_, test::request_of(kRead), now_);
    EXPECT_FALSE(book_.any(kId));
    EXPECT_TRUE(may_ask(now_, kRead));
    EXPECT_FALSE(may_ask(now_, kOther));
    answer(group_of(kId, kRead, 2), kReply);
    EXPECT_FALSE(may_ask(now_ + 100ms, kOther)) << "the retry's own reply may come second";
    EXPECT_TRUE(may_ask(now_ + timing::kRepeatsDamaged, kOther));
}

TEST_F(StationTest, P4AProbeWaitsAsLongAsMostRepliesTakeAndNowAndThenAsLongAsAnyTook) {
    for (int i = 0; i < 20; ++i) answer(kRead, kReply);
    now_ += 1s;
    const auto slow = test::answered(now_ - 450ms, now_, group_of(kId, kRead), kReply);
    station_.on_reply(book_, now_, slow, 450ms, 445ms);  // once, when a network hung
    while (!station_.health().offline()) {
        miss(kRead);
        station_.on_given_up(now_, Fault::timeout);
    }
    int dear = 0;
    for (int i = 0; i < 40; ++i) {
        dear += patience(kRead) > kTimeout / 2 ? 1 : 0;
        miss(kRead);
        station_.on_given_up(now_, Fault::timeout);
    }
    EXPECT_GE(dear, 2);
    EXPECT_LE(dear, 3);
}

TEST_F(StationTest, P4OneThatWasNeverHeardIsNowAndThenWaitedForLonger) {
    const Duration line = 10ms;  // what the other stations need
    Duration longest{};
    int longer = 0;
    for (int i = 0; i < 40; ++i) {
        miss(kRead);
        station_.on_given_up(now_, Fault::timeout);
        const Duration wait = station_.patience(group_of(kId, kRead), line, false);
        longest = std::max(longest, wait);
        longer += wait > 2 * line + timing::kReceiveMargin ? 1 : 0;
    }
    EXPECT_EQ(longest, kTimeout) << "it may need longer than they do";
    EXPECT_LE(longer, 10);
}

TEST_F(StationTest, P9AReadGoesBehindAWriteThatItIgnoredOrFourThatItAnswered) {
    const auto ask = [&](const Bytes& pdu) { station_.on_asked(book_, now_, group_of(kId, pdu)); };
    const modbus::Request write = test::request_of(kWrite);
    ask(kWrite);
    EXPECT_FALSE(station_.has_read_turn());
    station_.on_failed(now_, Verdict::silent, kTimeout, &write);
    EXPECT_TRUE(station_.has_read_turn());
    ask(kRead);
    for (int i = 0; i < Station::kWritesInARow; ++i) {
        EXPECT_FALSE(station_.has_read_turn());
        ask(kWrite);
    }
    EXPECT_TRUE(station_.has_read_turn());
    ask(kRead);
    answer(kRead, kReply);
    hear(now_ + 20ms, kReply);
    EXPECT_FALSE(station_.has_read_turn());
    ask(kWrite);
    EXPECT_TRUE(station_.has_read_turn()) << "while it rests others have the turns between";
}

TEST_F(StationTest, AnExceptionOrDamageIsExpectedAgainUntilSixteenRepliesHaveCome) {
    const auto answer_as_asked = [&](int times) {
        for (int i = 0; i < times; ++i) answer(kRead, kReply);
    };
    EXPECT_TRUE(station_.answers_as_asked());
    answer(kRead, "83 02"_hex);
    answer_as_asked(Station::kUnusualReplies - 1);
    EXPECT_FALSE(station_.answers_as_asked());
    answer_as_asked(1);
    EXPECT_TRUE(station_.answers_as_asked());
    miss(kRead, Verdict::damaged);
    EXPECT_FALSE(station_.answers_as_asked());
}

TEST_F(StationTest, P4AReadDecidesBeforeUnansweredWritesTakeItOffline) {
    answer(kRead, kReply);
    for (int i = 0; i < 2; ++i) station_.on_given_up(now_, Fault::timeout, false);
    EXPECT_FALSE(station_.wants_check());
    EXPECT_FALSE(station_.on_given_up(now_, Fault::timeout, false));
    EXPECT_TRUE(station_.wants_check());
    station_.on_asked(book_, now_, group_of(kId, kRead));
    EXPECT_FALSE(station_.wants_check());
    EXPECT_TRUE(station_.on_given_up(now_, Fault::timeout));
}

TEST_F(StationTest, ClassifiesAnUnsolicitedFrameAndChangesNothingByThat) {
    EXPECT_EQ(judged(now_, kReply), Done::unasked);
    answer(kRead, kReply);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(judged(now_ + 20ms, kReply), Done::duplicate);
        EXPECT_EQ(judged(now_ + 20ms, "03 02 00 00"_hex), Done::second);
        EXPECT_EQ(judged(now_ + 20ms, kLongReply), Done::unasked);
        EXPECT_EQ(judged(now_ + 1min, kReply), Done::unasked);
    }
    miss(kLong);
    EXPECT_EQ(judged(now_, kLongReply), Done::late);
    EXPECT_EQ(judged(now_, kLongReply), Done::late);
    EXPECT_TRUE(book_.any(kId));
}

TEST_F(StationTest, P4OneThatHasFallenSilentIsNotRetriedAndWaitedForAsLongAsItHasEverNeeded) {
    answer(kRead, kReply);
    EXPECT_EQ(patience(kRead), kTimeout);
    EXPECT_TRUE(station_.may_retry(group_of(kId, kRead)));
    EXPECT_FALSE(station_.may_retry(group_of(kId, kWrite)));
    station_.on_given_up(now_, Fault::timeout);
    EXPECT_TRUE(station_.missed_last());
    EXPECT_FALSE(station_.may_retry(group_of(kId, kRead)));
    EXPECT_GE(patience(kRead), Duration(30ms));
    EXPECT_LT(patience(kRead), kTimeout / 2);
    answer(kRead, kReply);
    EXPECT_FALSE(station_.missed_last());
    EXPECT_EQ(patience(kRead), kTimeout);
    station_.on_retry(false);
    EXPECT_FALSE(station_.missed_last());
    station_.on_retry(true);  // while it is due, its silence is known
    EXPECT_TRUE(station_.missed_last());
    EXPECT_LT(patience(kRead), kTimeout / 2);
    answer(kRead, kReply);
    EXPECT_FALSE(station_.missed_last());
}

TEST_F(StationTest, P4OneThatKeepsFailingWithoutBeingSilentHasAFifthOfTheBus) {
    for (int i = 0; i < 2 * Station::kFailing; ++i) {
        station_.on_failed(now_, Verdict::damaged, 100ms);
        EXPECT_FALSE(station_.on_given_up(now_, Fault::damaged));
    }
    EXPECT_TRUE(station_.failing());
    station_.on_failed(now_, Verdict::damaged, 100ms);
    EXPECT_FALSE(station_.may_spend(now_ + 399ms));
    EXPECT_TRUE(station_.may_spend(now_ + 401ms));
    EXPECT_FALSE(station_.may_retry(group_of(kId, kRead)));
    answer(kRead, kReply);
    EXPECT_FALSE(station_.failing());
}

TEST_F(StationTest, P4AReplyDoesNotPayForTheSilencesBeforeIt) {
    EXPECT_FALSE(station_.over_budget(now_, test::request_of(kRead)));
    miss(kRead);
    const TimePoint missed = now_;
    answer(kRead, kReply);
    EXPECT_TRUE(station_.over_budget(now_, test::request_of(kRead)));
    EXPECT_TRUE(station_.may_spend(now_)) << "one silence can happen to anybody";
    EXPECT_FALSE(station_.over_budget(missed + 4 * kTimeout, test::request_of(kRead)));
}

TEST_F(StationTest, P4FailuresBeyondAFifthThrottleItsRequests) {
    while (station_.may_spend(now_)) {
        miss(kRead);
        answer(kRead, kReply);
    }
    const TimePoint full = now_;
    while (!station_.may_spend(now_)) now_ += 1ms;
    EXPECT_LE(now_ - full, 5 * kTimeout) << "what one of them cost";
}

TEST_F(StationTest, P4HalfOfTheLastAttemptsInVainMakeItFlakyAndLateRepliesDoNotMend) {
    answer(kRead, kReply);
    for (int i = 0; i < Station::kFlaky; ++i) {
        EXPECT_FALSE(station_.flaky());
        miss(kRead);
        hear(now_ + 100ms, kReply);
    }
    EXPECT_TRUE(station_.flaky());
    EXPECT_LT(station_.patience(group_of(kId, kRead), std::nullopt, false, true), kTimeout / 2);
    for (int i = 0; i < 5; ++i) answer(kRead, kReply);
    EXPECT_FALSE(station_.flaky());
    for (int i = 0; i < 8; ++i) miss(kRead, Verdict::damaged);
    EXPECT_FALSE(station_.flaky()) << "damaged replies are no silence";
}

TEST_F(StationTest, P4ReadsDoNotPayForAWriteThatItIgnores) {
    answer(kRead, kReply);
    const modbus::Request ignored = test::request_of(kWrite);
    for (int i = 0; i < 5; ++i) {
        now_ += kTimeout;
        station_.on_failed(now_, Verdict::silent, kTimeout, &ignored);
    }
    EXPECT_TRUE(station_.may_spend(now_));
    EXPECT_FALSE(station_.may_spend(now_, &ignored));
    const modbus::Request other = test::request_of("06 00 6C 00 01"_hex);
    EXPECT_TRUE(station_.may_spend(now_, &other));
}

TEST_F(StationTest, P4WritesToSeveralPlacesThatItIgnoresInARowHaveOneShare) {
    answer(kRead, kReply);
    const modbus::Request other = test::request_of("06 00 6C 00 01"_hex);
    for (unsigned i = 0; i < 5; ++i) {
        EXPECT_TRUE(i > 2 || station_.may_spend(now_, &other)) << "others in a row " << i;
        now_ += kTimeout;
        const modbus::Request ignored = test::request_of(Writer().u8(6).u16(i).u16(1).take());
        station_.on_failed(now_, Verdict::silent, kTimeout, &ignored);
    }
    EXPECT_FALSE(station_.may_spend(now_, &other));
    EXPECT_TRUE(station_.may_spend(now_)) << "reads do not pay for that";
    answer(kWrite, kWrite);
    EXPECT_TRUE(station_.may_spend(now_, &other));
}

TEST_F(StationTest, P4OneThatIsBackIsNoLongerFlaky) {
    for (int i = 0; i < 8; ++i) {
        miss(kRead);
        station_.on_given_up(now_, Fault::timeout);
    }
    EXPECT_TRUE(station_.flaky());
    EXPECT_EQ(station_.condition(), Condition::offline);
    answer(kRead, kReply);
    EXPECT_FALSE(station_.flaky());
    EXPECT_EQ(station_.condition(), Condition::well);
}

TEST_F(StationTest, OnlyAnUnheardStationIsForgottenWhenNotWantedForAMinute) {
    Station unheard = station(false);
    unheard.on_asked(book_, now_, group_of(kId, kRead));
    station_.on_asked(book_, now_, group_of(kId, kRead));
    EXPECT_FALSE(unheard.forgettable(book_, now_ + timing::kForgetUnheard - 1ns));
    EXPECT_TRUE(unheard.forgettable(book_, now_ + timing::kForgetUnheard));
    EXPECT_FALSE(station_.forgettable(book_, now_ + 1h));
    unheard.on_wanted(now_ + 30s);
    EXPECT_FALSE(unheard.forgettable(book_, now_ + timing::kForgetUnheard));
    EXPECT_TRUE(unheard.forgettable(book_, now_ + 30s + timing::kForgetUnheard));
    unheard.replies().on_unanswered(book_, now_, kRead, now_);
    EXPECT_FALSE(unheard.forgettable(book_, now_ + 1h)) << "a reply is outstanding";
    unheard.on_unsolicited_frame(book_, now_ + 1s, Done::late, kReply);
    unheard.on_sign_of_life(now_ + 1s);
    EXPECT_FALSE(unheard.forgettable(book_, now_ + 1h)) << "it was heard";
}

/// Reads go another way than writes inside some panels: one that is answered after a later write
/// was taken for the answer to the next read, and so on for ever.
TEST_F(StationTest, P1WhoAnswersOutOfOrderIsBelievedNoOrderAndDrains) {
    miss(kRead);
    now_ += 100ms;
    const auto write = test::answered(now_ - 30ms, now_, group_of(kId, kWrite), kWrite);
    station_.on_reply(book_, now_, write, 30ms, 25ms);
    EXPECT_FALSE(book_.any(kId)) << "it serves in order, as far as is known";
    EXPECT_TRUE(may_have_passed(kReply, kOther));
    EXPECT_FALSE(may_have_passed(kReply, kRead)) << "its own earlier attempt may answer it";
    now_ += 100ms;
    EXPECT_EQ(hear(now_, kReply, true).done, Done::disorder);
    EXPECT_FALSE(may_ask(now_, kOther)) << "answers are one behind";
    EXPECT_FALSE(may_ask(now_, kLong));
    now_ = station_.replies().rested();
    EXPECT_TRUE(may_ask(now_, kOther));
    miss(kRead);
    answer(kWrite, kWrite);
    EXPECT_TRUE(book_.any(kId)) << "a later answer proves nothing";
    EXPECT_FALSE(station_.may_prove(book_));
}

TEST_F(StationTest, P8ABroadcastIsAwaitedAsLongAsItsAnswerHasTaken) {
    book_.on_broadcast(now_, kWrite);
    const auto delay = book_.behind_broadcast(now_ + 1s, kWrite);
    ASSERT_EQ(delay, Duration(1s));
    station_.replies().on_broadcast_answered(*delay, true);
    EXPECT_GT(station_.broadcast_window(), *delay);
    const auto other = test::request_of("06 00 09 00 07"_hex);
    EXPECT_EQ(book_.broadcasts_over(other, 1s, false), TimePoint{});
    EXPECT_EQ(book_.broadcasts_over(other, 1s, true), now_ + 1s) << "any may have its exception";
    EXPECT_EQ(book_.behind_broadcast(now_ + timing::kLatestBroadcastAnswer, kWrite), std::nullopt);
}

/// One silent or damaged transaction, without a retry.
TEST_F(StationTest, IsInTheWorstConditionThatIsTrueOfIt) {
    const auto fails = [&](Verdict verdict) {
        miss(kRead, verdict);
        station_.on_given_up(now_, verdict == Verdict::silent ? Fault::timeout : Fault::damaged);
        return station_.condition();
    };
    EXPECT_EQ(station_.condition(), Condition::unheard);
    EXPECT_EQ(fails(Verdict::silent), Condition::missed) << "listed, and never heard";
    answer(kRead, kReply);
    EXPECT_EQ(station_.condition(), Condition::well);
    EXPECT_EQ(fails(Verdict::damaged), Condition::well) << "not silent, and only once";
    EXPECT_EQ(fails(Verdict::damaged), Condition::failing);
    answer(kRead, kOtherValue);
    EXPECT_EQ(station_.condition(), Condition::well);
    EXPECT_EQ(fails(Verdict::silent), Condition::missed);
    EXPECT_EQ(fails(Verdict::silent), Condition::failing);
    EXPECT_EQ(fails(Verdict::silent), Condition::offline);
    answer(kRead, kThirdValue);
    EXPECT_EQ(station_.condition(), Condition::well) << "it is back";
    for (int i = 0; i < Station::kFlaky; ++i) {
        fails(Verdict::silent);
        answer(kRead, kReply);
    }
    EXPECT_EQ(station_.condition(), Condition::flaky);
}

}  // namespace
}  // namespace panelgate::arbiter::station_test
