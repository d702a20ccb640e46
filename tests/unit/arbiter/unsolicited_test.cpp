#include "panelgate/arbiter/unsolicited.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "panelgate/base/words.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::unsolicited_test {
namespace {

using modbus::encode_adu;

const Bytes kRead = "03 00 6B 00 01"_hex;
const Bytes kReply = "03 02 02 2B"_hex;
const Bytes kAnswer = encode_adu(17, kReply);

Settings one_station() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.stations = {settings.unlisted};
    settings.stations[0].id = 17;
    return settings;
}

/// A line with station 17, which was asked for kRead.
class UnsolicitedFramesTest : public testing::Test {
  protected:
    UnsolicitedFramesTest() {
        unsolicited.on_sent(now, encode_adu(17, kRead));
        quiet.on_sent(now, 17);
        stations.of(17);
    }
    /// Classification of these bytes in the trace, separated by blanks.
    std::string heard(const Bytes& bytes, bool idle = false) {
        now += 1s;
        quiet.on_noise(now);
        unsolicited.hear(now, bytes);
        unsolicited.note(now, unsolicited.take(17), idle, stations, quiet, outbox);
        EXPECT_FALSE(unsolicited.pending());
        std::string words;
        while (const auto action = outbox.poll()) {
            const auto* note = std::get_if<Note>(&*action);
            if (note == nullptr) continue;
            EXPECT_EQ(direction_of(note->kind), FrameDirection::discarded);
            words += (words.empty() ? "" : " ") + std::string(label(note->kind));
        }
        return words;
    }
    bool is_wrong_reply(const Bytes& adu, Duration heard_after = 10ms) const {
        return unsolicited.is_wrong_reply(now, adu, stations, heard_after);
    }
    const StationCounters& counters() const { return outbox.stations().at(17); }

    Settings settings = one_station();
    UnsolicitedFrames unsolicited{settings.serial};
    Stations stations{settings};
    Quiet quiet{1s, 2ms};
    Outbox outbox{settings};
    TimePoint now{1h};
};

TEST_F(UnsolicitedFramesTest, AreClassifiedAndCounted) {
    EXPECT_EQ(heard(encode_adu(17, kRead)), "echo") << "sent last";
    EXPECT_EQ(counters().symptoms.echoes, 1u);
    EXPECT_EQ(counters().foreign_frames, 0u);
    EXPECT_EQ(heard(encode_adu(18, kRead)), "foreign request") << "another master's";
    EXPECT_EQ(counters().symptoms.requests, 1u);
    EXPECT_EQ(counters().foreign_frames, 1u);
    stations.of(17).replies().on_unanswered(stations.book(), now, kRead, now - 500ms);
    EXPECT_EQ(heard(kAnswer), "late") << "outstanding";
    EXPECT_EQ(counters().late_frames, 1u);
    EXPECT_EQ(counters().foreign_frames, 1u);
    EXPECT_EQ(heard(kAnswer), "foreign") << "it was outstanding once only";
    EXPECT_EQ(heard(encode_adu(99, kReply)), "foreign");
    EXPECT_EQ(counters().symptoms.unasked, 1u);
    EXPECT_EQ(outbox.stations().at(0).symptoms.unasked, 1u) << "of the station that it names";
    EXPECT_EQ(counters().foreign_frames, 3u);
    const auto discarded = counters().discarded_bytes;
    EXPECT_EQ(heard("FF 00 FF"_hex), "damaged");
    EXPECT_EQ(counters().symptoms.strays, 1u);
    EXPECT_EQ(counters().discarded_bytes, discarded + 3);
    EXPECT_EQ(heard(Writer().raw(encode_adu(99, kReply)).u8(0xFF).take()), "foreign damaged");
}

/// An adapter that lets all but its last byte through: the CRC of the rest is good where that is 0.
TEST_F(UnsolicitedFramesTest, OurOwnFrameWithoutALast0IsNoReply) {
    Bytes own = encode_adu(17, kRead);
    for (unsigned address = 0; own.back() != 0 && address < 0x10000; ++address)
        own = encode_adu(17, Writer().u8(3).u16(address).u16(4).take());
    ASSERT_EQ(own.back(), 0);
    unsolicited.on_sent(now, own);
    own.pop_back();
    EXPECT_FALSE(is_wrong_reply(own));
    EXPECT_EQ(heard(own), "echo");
}

/// What it closed might be the retry's: it only shows that its station is there.
TEST_F(UnsolicitedFramesTest, P4ALateReplyInPiecesBringsItsStationBackAndClosesNothing) {
    Station& station = stations.of(17);
    station.replies().on_unanswered(stations.book(), now, kRead, now - 500ms);
    while (!station.on_given_up(now, Fault::timeout, true)) {
    }
    const auto hear = [&](ByteView bytes) {
        unsolicited.hear(now, bytes);
        unsolicited.note(now, unsolicited.joined(now, unsolicited.take(17), stations), true,
                         stations, quiet, outbox);
    };
    const ByteView whole = kAnswer;
    hear(whole.first(2));  // some panels say that before
    hear(whole.first(6));
    EXPECT_TRUE(station.health().offline());
    hear(whole.subspan(6));
    EXPECT_FALSE(station.health().offline());
    EXPECT_TRUE(stations.book().any(17));
    EXPECT_EQ(counters().late_frames, 0u);
}

TEST_F(UnsolicitedFramesTest, BehindAnotherMastersRequestTheLineRestsForItsReply) {
    EXPECT_LT(quiet.free_at(2ms), now + 1s);
    heard(encode_adu(18, kRead));
    EXPECT_GE(quiet.free_at(2ms), now + 20ms) << "a panel may think as long";
    EXPECT_LE(quiet.free_at(2ms), now + 200ms);
}

TEST_F(UnsolicitedFramesTest, UnansweredOrAlreadyAnsweredRequestsNeedNoRest) {
    heard(encode_adu(0, "10 00 01 00 01 02 00 05"_hex));
    EXPECT_EQ(quiet.free_at(2ms), now + 2ms) << "a broadcast";
    heard(Writer().raw(encode_adu(18, kRead)).raw(encode_adu(18, kReply)).take());
    EXPECT_EQ(quiet.free_at(2ms), now + 2ms) << "its reply was heard with it";
}

TEST_F(UnsolicitedFramesTest, AWrongReplyIsNeitherEchoNorRequestNorOutstanding) {
    EXPECT_TRUE(is_wrong_reply(kAnswer));
    EXPECT_FALSE(is_wrong_reply(encode_adu(17, kRead))) << "echo";
    EXPECT_FALSE(is_wrong_reply(encode_adu(17, "03 00 00 00 01"_hex))) << "a request";
    EXPECT_FALSE(is_wrong_reply(encode_adu(99, kReply))) << "nobody";
    stations.of(17).replies().on_unanswered(stations.book(), now, kRead, now - 500ms);
    EXPECT_FALSE(is_wrong_reply(kAnswer)) << "outstanding";
}

/// A panel that refuses everything with the same function's number: each refusal repeats another.
TEST_F(UnsolicitedFramesTest, AnEqualRefusalInTheUsualTimeMayBeMeantForThisRequest) {
    const Bytes refusal = "84 02"_hex;
    stations.of(17).replies().on_unanswered(stations.book(), now, "04 00 6B 00 01"_hex,
                                            now - 500ms);
    EXPECT_EQ(heard(encode_adu(17, refusal)), "late");
    now += 100ms;
    ASSERT_EQ(judge(stations.of(17).replies().facts(stations.book(), now, refusal)),
              Done::duplicate);
    EXPECT_TRUE(is_wrong_reply(encode_adu(17, refusal)));
}

/// Once it was one within four requests after the broadcast, once within a time: they disagreed.
TEST_F(UnsolicitedFramesTest, AReplyToABroadcastIsOneForSeconds) {
    const Bytes write = "10 00 01 00 01 02 00 05"_hex;
    const Bytes reply = encode_adu(17, modbus::normal_write_reply(write));
    stations.book().on_broadcast(now, write);
    for (int i = 0; i < 10; ++i) unsolicited.on_sent(now, encode_adu(17, kRead));
    now += 900ms;
    EXPECT_FALSE(is_wrong_reply(reply));
    now += timing::kLatestBroadcastAnswer;
    EXPECT_TRUE(is_wrong_reply(reply));
}

TEST_F(UnsolicitedFramesTest, GathersNoMoreThanAnyFrameHas) {
    EXPECT_FALSE(unsolicited.pending());
    unsolicited.hear(now, Bytes(modbus::ReplyFramer::kMaxHeard, 0xFF));
    EXPECT_TRUE(unsolicited.pending());
    EXPECT_FALSE(unsolicited.full());
    unsolicited.hear(now, "FF"_hex);
    EXPECT_TRUE(unsolicited.full());
    unsolicited.forget();
    EXPECT_FALSE(unsolicited.pending());
}

TEST(StationTrail, P5WhatHasFollowedTheReplyAlreadyIsNotRestedFor) {
    constexpr Duration kBehind = 50ms;
    constexpr Duration kCopy = 10ms;
    const Group read = test::group_of(17, kRead);
    StationSettings settings;
    settings.id = 17;
    Station station(settings, OfflineSettings{}, true);
    OutstandingRequests book;
    TimePoint now{1h};
    for (std::size_t i = 0; i <= Trail::kReplies; ++i) {
        now += 1s;
        station.on_reply(book, now, test::answered(now - 30ms, now, read, kReply), 30ms, 25ms);
        if (i < Trail::kReplies) station.on_unsolicited_bytes(now + kBehind);
    }
    EXPECT_GE(station.trail_until(), now + kBehind);
    now += 1s;
    Attempt twice = test::answered(now - kCopy - 30ms, now - kCopy, read, kReply);
    twice.keep_candidate(60ms, Answers::Kept::doubted);
    ASSERT_EQ(twice.on_rx(now, kAnswer, [](ByteView) { return false; }), Verdict::replied);
    station.on_reply(book, now, twice, 30ms, 25ms);
    EXPECT_LE(station.trail_until(), now + kCopy * 5 / 4) << "of a further copy alone";
}

TEST_F(UnsolicitedFramesTest, TheTrailBelongsToTheStationThatAnsweredLast) {
    EXPECT_EQ(unsolicited.replied_before(), 0);
    unsolicited.on_replied(now, 17);
    EXPECT_EQ(unsolicited.replied_before(), 0) << "it answered what is on the wire";
    unsolicited.on_sent(now, encode_adu(18, kRead));
    EXPECT_EQ(unsolicited.replied_before(), 17);
    unsolicited.on_sent(now, encode_adu(18, kRead));
    EXPECT_EQ(unsolicited.replied_before(), 0) << "the one between was not answered";
}

}  // namespace
}  // namespace panelgate::arbiter::unsolicited_test
