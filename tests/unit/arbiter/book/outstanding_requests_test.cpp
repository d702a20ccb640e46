#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/reply_habits.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::outstanding_requests_test {
namespace {

using modbus::encode_adu;
using test::request_of;

const Bytes kThree = "03 00 64 00 03"_hex;
const Bytes kReplyOfThree = "03 06 00 01 00 02 00 03"_hex;
const Bytes kTwo = "03 00 64 00 02"_hex;
const Bytes kReplyOfTwo = "03 04 00 01 00 02"_hex;
const Bytes kRefusal = "83 02"_hex;

TimePoint at(Duration since) { return TimePoint{} + since; }

constexpr std::uint8_t kId = 17;

class OutstandingTest : public testing::Test {
  protected:
    void add(Duration sent, const Bytes& pdu) { book_.on_unanswered(kId, at(sent), pdu); }
    TimePoint oldest(const Bytes& reply) const { return book_.first(kId, reply)->sent; }
    bool fits(const Bytes& reply) const { return claims(reply).outstanding; }
    bool ambiguous(const Bytes& pdu, bool again = false) const {
        return book_.is_ambiguous(kId, request_of(pdu), again);
    }
    Claims claims(const Bytes& reply) const { return book_.claims(at(1h), kId, reply, {}); }

    OutstandingRequests book_;
};

TEST_F(OutstandingTest, TakesTheOldestThatAReplyMayAnswer) {
    add(1s, kThree);
    add(2s, kThree);
    add(3s, kTwo);
    book_.take(kId, kReplyOfTwo);
    EXPECT_FALSE(fits(kReplyOfTwo));
    EXPECT_EQ(oldest(kReplyOfThree), at(1s));
    book_.take(kId, kReplyOfThree);
    EXPECT_EQ(oldest(kReplyOfThree), at(2s));
    book_.take(kId, kReplyOfTwo);
    EXPECT_EQ(book_.count(kId), 1u);
}

TEST_F(OutstandingTest, ARefusalMayBeOfAny) {
    add(1s, kThree);
    add(2s, kTwo);
    EXPECT_TRUE(fits(kRefusal));
    EXPECT_EQ(book_.first(kId, kRefusal)->pdu, kThree);
}

TEST_F(OutstandingTest, IsOfOneStationAndOneLine) {
    add(1s, kThree);
    EXPECT_FALSE(book_.any(kId + 1));
    EXPECT_FALSE(book_.claims(at(2s), kId + 1, kReplyOfThree, {}).outstanding);
    EXPECT_FALSE(book_.is_ambiguous(kId + 1, request_of(kThree)));
    book_.forget(kId);
    EXPECT_FALSE(book_.any(kId));
}

TEST_F(OutstandingTest, TellsTheOpenRequestFromOthers) {
    add(1s, kThree);
    const Claims same = book_.claims(at(2s), kId, kRefusal, {}, kThree);
    EXPECT_TRUE(same.outstanding);
    EXPECT_FALSE(same.other_outstanding) << "an earlier attempt of it";
    add(2s, kTwo);
    EXPECT_TRUE(book_.claims(at(2s), kId, kRefusal, {}, kThree).other_outstanding);
}

TEST_F(OutstandingTest, PassesOverWhatCouldNotComeAnyMore) {
    add(1s, kThree);
    add(2s, kThree);
    EXPECT_EQ(book_.first(kId, kReplyOfThree, at(1s))->sent, at(2s));
    EXPECT_EQ(book_.first(kId, kReplyOfThree, at(5s))->sent, at(2s)) << "the last, if none could";
    EXPECT_EQ(book_.first(kId, kReplyOfTwo, at(0s)), nullptr);
    OutstandingRequests::Windows windows;
    windows.outstanding = at(2s);
    EXPECT_FALSE(book_.claims(at(3s), kId, kReplyOfThree, windows).outstanding);
}

TEST_F(OutstandingTest, KnowsWhetherAReadsReplyWouldBeItsOwn) {
    add(1s, kThree);
    EXPECT_TRUE(ambiguous("03 00 00 00 03"_hex)) << "of another place, but as long";
    EXPECT_FALSE(ambiguous(kTwo));
    EXPECT_FALSE(ambiguous("04 00 64 00 03"_hex));
    add(2s, "01 00 00 00 08"_hex);
    EXPECT_TRUE(ambiguous("01 00 00 00 01"_hex)) << "a byte each";
    EXPECT_FALSE(ambiguous("01 00 00 00 09"_hex));
    EXPECT_TRUE(ambiguous(kThree)) << "asked anew, its value would be too old";
    EXPECT_FALSE(ambiguous(kThree, true)) << "repeated, it is an answer";
    add(3s, "06 00 01 00 07"_hex);
    EXPECT_FALSE(ambiguous("06 00 01 00 08"_hex)) << "the reply names the value";
    EXPECT_TRUE(ambiguous("06 00 01 00 07"_hex));
    add(4s, "10 00 01 00 01 02 00 07"_hex);
    EXPECT_TRUE(ambiguous("10 00 01 00 01 02 00 08"_hex)) << "and that of 10 only the count";
}

TEST_F(OutstandingTest, StationsServeInTurn) {
    add(1s, kThree);
    book_.on_opened(at(2s));
    add(3s, kTwo);
    add(5s, kThree);
    book_.pass(kId, at(5s));
    EXPECT_EQ(book_.count(kId), 2u);
    EXPECT_EQ(oldest(kReplyOfThree), at(1s)) << "of another connection";
    EXPECT_FALSE(fits(kReplyOfTwo));
    EXPECT_TRUE(claims(kReplyOfTwo).closed) << "but some panels do not serve so";
    EXPECT_EQ(book_.take_closed(kId, kReplyOfTwo, at(0s)).pdu, kTwo);
    EXPECT_FALSE(claims(kReplyOfTwo).closed);
    book_.on_opened({});
    book_.pass(kId, at(9s));
    EXPECT_FALSE(book_.any(kId));
}

TEST_F(OutstandingTest, OverTwoConnectionsTheOrderIsUnknown) {
    add(1s, kThree);
    book_.on_opened(at(2s));
    add(3s, kThree);
    book_.close(kId, kReplyOfThree, false);
    EXPECT_EQ(book_.count(kId), 2u);
    book_.lapse(kId, at(2s));
    book_.close(kId, kReplyOfThree, false);
    EXPECT_FALSE(book_.any(kId));
}

TEST_F(OutstandingTest, IsOnlyOfOneRequest) {
    EXPECT_FALSE(book_.is_only(kId, kThree));
    add(1s, kThree);
    EXPECT_TRUE(book_.is_only(kId, kThree));
    book_.on_reply(kId, at(1s), kTwo, kReplyOfTwo);
    EXPECT_TRUE(book_.is_only(kId, kThree)) << "what was answered does not count";
    add(2s, kTwo);
    EXPECT_FALSE(book_.is_only(kId, kThree));
    EXPECT_EQ(book_.first_sent(kId), at(1s));
    EXPECT_EQ(book_.last_sent(kId), at(2s));
}

TEST_F(OutstandingTest, ForgetsTheOldestOfTooMany) {
    for (std::size_t i = 0; i < OutstandingRequests::kMost + 2; ++i)
        add(std::chrono::seconds(i), kThree);
    EXPECT_EQ(book_.count(kId), OutstandingRequests::kMost);
    EXPECT_EQ(oldest(kReplyOfThree), at(2s));
}

/// A panel with a reply buffer for each function says the last one of that once more.
TEST_F(OutstandingTest, P1RemembersTheLastReplyOfEachFunction) {
    const Bytes coils = "01 01 05"_hex;
    book_.on_reply(kId, at(1s), "01 00 00 00 08"_hex, "01 01 04"_hex);
    book_.on_reply(kId, at(2s), "01 00 08 00 08"_hex, coils);
    for (std::size_t i = 0; i < 3 * OutstandingRequests::kReplies; ++i)
        book_.on_reply(kId, at(3s + i * 1ms), kThree, kReplyOfThree);
    const Bytes open = "01 00 10 00 08"_hex;
    EXPECT_TRUE(book_.claims(at(9s), kId, coils, {}, open).repeats_other);
    EXPECT_FALSE(book_.claims(at(9s), kId, "01 01 04"_hex, {}, open).repeats_other);
}

TEST_F(OutstandingTest, BroadcastsAreRememberedOfTheLastOnesAndConcernNoReads) {
    const Bytes to_all = "10 00 64 00 02 04 00 0A 01 02"_hex;
    const Bytes elsewhere = "10 00 68 00 02 04 00 0B 00 00"_hex;
    const auto to_one = request_of("10 00 64 00 02 04 00 0B 00 00"_hex);
    const auto over = [&](const modbus::Request& request) {
        return book_.broadcasts_over(request, 1s, false);
    };
    EXPECT_EQ(over(to_one), TimePoint{});
    book_.on_broadcast(at(1h), to_all);
    EXPECT_EQ(over(to_one), at(1h + 1s));
    EXPECT_EQ(over(request_of(kThree)), TimePoint{});
    for (std::size_t i = 0; i + 1 < OutstandingRequests::kBroadcasts; ++i)
        book_.on_broadcast(at(1h + 1s), elsewhere);
    EXPECT_EQ(over(to_one), at(1h + 1s));
    book_.on_broadcast(at(1h + 1s), elsewhere);
    EXPECT_EQ(over(to_one), TimePoint{});
}

class ForeignTest : public testing::Test {
  protected:
    void hear(const Bytes& adu) { book_.on_foreign(at(1s), adu, false); }
    bool fits(std::uint8_t station, const Bytes& pdu, Duration now = 1s) const {
        return book_.claims(at(now), station, pdu, {}).other_master;
    }

    OutstandingRequests book_;
};

TEST_F(ForeignTest, RequestsMatchWhatMayAnswerOneOfThem) {
    Bytes heard = encode_adu(17, "03 00 00 00 01"_hex);
    heard.push_back(0x55);  // more bytes follow
    hear(heard);
    EXPECT_TRUE(fits(17, "03 02 00 07"_hex));
    EXPECT_TRUE(fits(17, kRefusal));
    EXPECT_FALSE(fits(18, "03 02 00 07"_hex));
    EXPECT_FALSE(fits(17, "03 04 00 07 00 08"_hex));
    EXPECT_TRUE(fits(17, kRefusal, 1s + timing::kLatestRepetition));
    EXPECT_FALSE(fits(17, kRefusal, 2s));
    book_.forget_foreign();
    EXPECT_FALSE(fits(17, kRefusal));
}

TEST_F(ForeignTest, WhatMayBeARequestContestsTheOpenOneAlone) {
    book_.on_foreign(at(1s), encode_adu(17, "06 00 01 00 03"_hex), true);
    const Bytes reply = "06 00 01 00 03"_hex;
    EXPECT_FALSE(fits(17, reply));
    OutstandingRequests::Windows windows;
    windows.contested = at(1s);
    EXPECT_TRUE(book_.claims(at(1s), 17, reply, windows).contested);
    windows.contested = at(2s);
    EXPECT_FALSE(book_.claims(at(2s), 17, reply, windows).contested) << "heard before it";
}

TEST_F(ForeignTest, ABroadcastHasNoAnswer) {
    hear(encode_adu(0, "06 00 01 00 03"_hex));
    EXPECT_FALSE(fits(0, "06 00 01 00 03"_hex));
}

TEST_F(ForeignTest, TheOldestOfTooManyIsForgotten) {
    for (unsigned i = 1; i <= OutstandingRequests::kForeign + 1; ++i)
        hear(encode_adu(17, Writer().u8(3).u16(0).u16(i).take()));
    EXPECT_FALSE(fits(17, "03 02 00 07"_hex));
    EXPECT_TRUE(fits(17, "03 04 00 07 00 08"_hex));
}

const Bytes kRequest = "03 00 6B 00 01"_hex;
const Bytes kOtherRequest = "03 00 6C 00 01"_hex;
const Bytes kReply = "03 02 00 01"_hex;
const Bytes kOtherReply = "03 02 00 02"_hex;
constexpr Duration kTooLate = timing::kLatestRepetition + 1ns;

/// The habit beside the book, as ReplyHabits keeps them.
class DuplicatesTest : public testing::Test {
  protected:
    void remember(TimePoint at, const Bytes& request, const Bytes& pdu) {
        habit_.on_reply(at);
        book_.on_reply(kId, at, request, pdu);
    }
    void reply(const Bytes& pdu = kReply) {
        now_ += 1s;
        remember(now_, kRequest, pdu);
    }
    Claims claims(TimePoint now, const Bytes& pdu, const Bytes& request = kRequest) const {
        return book_.claims(now, kId, pdu, {}, request);
    }
    bool has_last_form(TimePoint now, const Bytes& pdu) const {
        return book_.claims(now, kId, pdu, {}).has_last_form;
    }
    TimePoint given(TimePoint now, const Bytes& pdu) const { return book_.given(kId, now, pdu); }
    void repeat(Duration behind) {
        habit_.learn(now_ + behind, now_ + behind - given(now_ + behind, kReply));
    }
    void deny(TimePoint when) { habit_.on_denied(when, book_.given(kId, when, kReply, when)); }
    void answer_twice(TimePoint now, TimePoint first) {
        habit_.on_repeated_reply(now, first, given(first, kReply));
    }
    void confirm(const Bytes& request, const Bytes& pdu) {
        for (int i = 0; i < DuplicateHabit::kConfirmations; ++i) habit_.on_confirmed(request, pdu);
    }
    bool suspicious(Duration behind, const Bytes& request = kOtherRequest,
                    const Bytes& pdu = kReply) const {
        const TimePoint now = now_ + behind;
        return habit_.suspicious(now, request, pdu, claims(now, pdu, request));
    }

    OutstandingRequests book_;
    DuplicateHabit habit_;
    TimePoint now_{1h};
};

TEST_F(DuplicatesTest, P1AnExactRepetitionOfARecentReplyIsADuplicate) {
    EXPECT_FALSE(claims(now_, kReply).repeats);
    reply();
    remember(now_ + 50ms, kOtherRequest, kOtherReply);
    EXPECT_TRUE(claims(now_ + 60ms, kReply).repeats) << "also of the one before";
    EXPECT_TRUE(claims(now_ + 60ms, kOtherReply).repeats);
    EXPECT_FALSE(claims(now_ + 60ms, "03 02 00 03"_hex).repeats);
    EXPECT_FALSE(claims(now_ + kTooLate, kReply).repeats);
}

TEST_F(DuplicatesTest, P1OneDuplicateShowsThatTheStationSendsTwiceAndHowLongItMustRest) {
    reply();
    repeat(20ms);
    EXPECT_TRUE(habit_.known());
    EXPECT_GT(habit_.settle_time(), Duration(20ms));
    EXPECT_LT(habit_.settle_time(), Duration(60ms));
    for (const Duration behind : {80ms, 5ms}) {
        reply();
        repeat(behind);
        EXPECT_GT(habit_.settle_time(), Duration(80ms)) << "as long as the longest";
    }
}

/// An answer equal to an earlier one came twice: one of them is its duplicate, or the earlier
/// one's.
TEST_F(DuplicatesTest, P5ADelayThatWasOnlyGuessedIsForgottenWhereDuplicatesComeMuchSooner) {
    reply();
    answer_twice(now_ + 400ms, now_ + 370ms);
    EXPECT_GT(habit_.settle_time(), Duration(370ms)) << "either";
    for (int i = 1; i < DuplicateHabit::kConfirmations; ++i) {
        reply();
        repeat(30ms);
    }
    repeat(200ms);
    EXPECT_GT(habit_.settle_time(), Duration(370ms)) << "not in a row";
    for (int i = 0; i < DuplicateHabit::kConfirmations; ++i) {
        reply();
        repeat(40ms);
    }
    EXPECT_EQ(habit_.settle_time(), Duration(200ms) * 3 / 2) << "the longest that was seen";
}

TEST_F(DuplicatesTest, P1WhatOnlyHasTheShapeOfTheReplyHasToComeTwice) {
    reply();
    EXPECT_TRUE(has_last_form(now_ + 20ms, kOtherReply));
    EXPECT_FALSE(book_.on_followed(kId));
    EXPECT_FALSE(book_.on_followed(kId)) << "of the same reply";
    reply();
    EXPECT_TRUE(book_.on_followed(kId));
}

TEST_F(DuplicatesTest, WhatHasAnotherShapeOrComesLongAfterTeachesNothing) {
    for (int i = 0; i < 5; ++i) {
        reply();
        EXPECT_FALSE(has_last_form(now_ + 20ms, kReplyOfTwo));
        EXPECT_FALSE(has_last_form(now_ + kTooLate, kOtherReply));
        EXPECT_FALSE(claims(now_ + kTooLate, kReply).repeats);
    }
}

TEST_F(DuplicatesTest, IsForgottenSomeMinutesAfterItStopped) {
    reply();
    repeat(20ms);
    const TimePoint last = now_;
    while (now_ < last + timing::kForgetDuplicates - 1s) reply();
    EXPECT_TRUE(habit_.known());
    for (int i = 0; i < 3; ++i) reply();
    EXPECT_FALSE(habit_.known());
}

TEST_F(DuplicatesTest, P1AnEqualAnswerToAnotherReadIsSuspiciousForAMinute) {
    reply();
    EXPECT_TRUE(suspicious(20ms));
    EXPECT_FALSE(suspicious(20ms, kRequest));
    EXPECT_FALSE(suspicious(20ms, kOtherRequest, kOtherReply));
    EXPECT_FALSE(suspicious(timing::kLatestCopy + 1s));
}

TEST_F(DuplicatesTest, P1AStationThatWasSeenToGiveEqualAnswersIsBelievedUntilItSpeaksTwice) {
    reply();
    for (int i = 0; i < DuplicateHabit::kConfirmations; ++i) {
        EXPECT_TRUE(suspicious(20ms));
        habit_.on_confirmed(kOtherRequest, kReply);
    }
    EXPECT_FALSE(suspicious(20ms));
    repeat(20ms);
    EXPECT_TRUE(suspicious(30ms));
}

TEST_F(DuplicatesTest, P1EqualAnswersToWritesAndEqualExceptionsEarnNoTrustForValues) {
    reply();
    confirm("10 00 10 00 01 02 00 01"_hex, "10 00 10 00 01"_hex);
    EXPECT_TRUE(suspicious(20ms));
    confirm(kOtherRequest, "83 06"_hex);
    EXPECT_TRUE(suspicious(20ms));
}

/// The value may just have changed: only several in a row, within minutes, show a duplicate.
TEST_F(DuplicatesTest, P1AReplyDeniedThreeTimesWhenAskedOnceMoreWasADuplicate) {
    const auto ask = [&] {
        now_ += 1s;
        reply();
        deny(now_ + 20ms);
    };
    ask();
    ask();
    habit_.on_confirmed(kOtherRequest, kReply);
    ask();
    EXPECT_FALSE(habit_.known()) << "not in a row";
    now_ += timing::kForgetDuplicates + 1s;
    ask();
    ask();
    EXPECT_FALSE(habit_.known()) << "the first was long ago";
    ask();
    EXPECT_EQ(habit_.settle_time(), Duration(30ms));
}

TEST_F(DuplicatesTest, P1AStationThatIsDeniedIsNoLongerTrusted) {
    reply();
    confirm(kOtherRequest, kReply);
    EXPECT_FALSE(suspicious(20ms));
    deny(now_ + 20ms);
    EXPECT_TRUE(suspicious(20ms));
}

/// A panel whose empty registers are alike may still say its other replies twice.
TEST(EqualAnswers, P1ZerosSayNothingOfOtherValues) {
    EqualAnswers seen;
    for (int i = 0; i < EqualAnswers::kEnough; ++i) {
        EXPECT_FALSE(seen.trusts(kReply));
        seen.add(kReply);
    }
    EXPECT_TRUE(seen.trusts(kReply));
    EXPECT_FALSE(seen.trusts(kOtherReply));
    seen.add("03 02 00 03"_hex);
    EXPECT_FALSE(seen.trusts(kOtherReply));
    seen.add("03 02 00 04"_hex);
    EXPECT_TRUE(seen.trusts(kOtherReply)) << "it shows the same in several places";
}

TEST_F(DuplicatesTest, P1AfterADenialAnEqualAnswerToTheVerySameRequestIsSuspiciousToo) {
    reply();
    EXPECT_FALSE(suspicious(20ms, kRequest));
    deny(now_ + 20ms);
    EXPECT_TRUE(suspicious(40ms, kRequest));
    habit_.on_confirmed(kRequest, kReply);
    EXPECT_FALSE(suspicious(60ms, kRequest)) << "it has not changed";
    deny(now_ + 80ms);
    now_ += timing::kForgetDuplicates + 1s;
    reply();
    EXPECT_FALSE(suspicious(20ms, kRequest)) << "long ago";
}

TEST_F(DuplicatesTest, P1AStationThatAnswersOneRequestTwiceSendsDuplicates) {
    answer_twice(now_ + 30ms, now_ + 10ms);
    EXPECT_EQ(habit_.settle_time(), Duration(30ms));
    reply();
    answer_twice(now_ + 80ms, now_ + 50ms);
    EXPECT_EQ(habit_.settle_time(), Duration(45ms)) << "they come as late as that";
    answer_twice(now_ + 50ms + timing::kLatestRepetition + 1ms, now_ + 50ms);
    EXPECT_EQ(habit_.settle_time(), Duration(45ms)) << "later, it is something else";
    answer_twice(now_ + 130ms, now_ + 80ms);
    EXPECT_EQ(habit_.settle_time(), Duration(120ms))
        << "the first may have been a duplicate of the one before";
}

/// Once its own duplicate behind it passed for one of an earlier equal answer, half a second ago,
/// and the station rested for so long behind each reply.
TEST_F(DuplicatesTest, ADoubtedAnswerIsADuplicateOfNoneButEarlierOnes) {
    reply();
    remember(now_ + 400ms, kRequest, kReply);
    for (int i = 0; i < DuplicateHabit::kDenials; ++i) deny(now_ + 400ms);
    EXPECT_EQ(habit_.settle_time(), Duration(600ms));
    habit_ = {};
    book_ = OutstandingRequests();
    reply();
    remember(now_ + 400ms, kRequest, kReply);
    repeat(430ms);
    EXPECT_EQ(habit_.settle_time(), Duration(45ms));
}

TEST_F(DuplicatesTest, P1WhatIsInDoubtIsWaitedForBehindOneMoreReply) {
    reply();
    habit_.on_doubt(20ms);
    EXPECT_FALSE(habit_.known());
    EXPECT_GE(habit_.take_doubt(), Duration(20ms));
    EXPECT_EQ(habit_.take_doubt(), Duration(0));
}

TEST_F(DuplicatesTest, P1AStationRepeatsItselfAsSoonAsItsDuplicatesComeAndNotMuchLater) {
    reply();
    EXPECT_FALSE(habit_.repeats_itself(now_ + 1ms, given(now_ + 1ms, kReply))) << "not known";
    repeat(20ms);
    EXPECT_TRUE(habit_.repeats_itself(now_ + 40ms, given(now_ + 40ms, kReply)));
    EXPECT_FALSE(habit_.repeats_itself(now_ + 40ms, given(now_ + 40ms, kOtherReply)));
    EXPECT_FALSE(habit_.repeats_itself(now_ + 100ms, given(now_ + 100ms, kReply)));
}

TEST_F(DuplicatesTest, P1FindsADuplicateAmidOtherBytes) {
    reply();
    Bytes amid = Writer().u8(0).u8(0xFF).raw(encode_adu(0x11, kReply)).take();
    EXPECT_NE(book_.given_in(now_ + 20ms, 0x11, amid, modbus::CrcOrder::low_first), nullptr);
    EXPECT_EQ(book_.given_in(now_ + 20ms, 0x12, amid, modbus::CrcOrder::low_first), nullptr);
    EXPECT_EQ(book_.given_in(now_ + kTooLate, 0x11, amid, modbus::CrcOrder::low_first), nullptr);
    amid.back() ^= 1;
    EXPECT_EQ(book_.given_in(now_ + 20ms, 0x11, amid, modbus::CrcOrder::low_first), nullptr)
        << "a damaged reply of equal values";
}

TEST_F(DuplicatesTest, ADuplicateIsOfTheLatestReplyThatItRepeats) {
    reply();
    remember(now_ + 200ms, kOtherRequest, kReply);
    repeat(220ms);
    EXPECT_TRUE(habit_.known());
    EXPECT_LT(habit_.settle_time(), Duration(60ms));
}

}  // namespace
}  // namespace panelgate::arbiter::outstanding_requests_test
