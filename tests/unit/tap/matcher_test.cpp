#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "heard_line.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

using namespace panelgate;
using namespace panelgate::tap;
using panelgate::tap::test::Line;
using panelgate::tap::test::pdu;

namespace {

Bytes operator+(Bytes a, const Bytes& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Bytes adu(std::uint8_t station, std::string_view hex) {
    return modbus::encode_adu(station, pdu(hex));
}

constexpr const char* kRead = "0300640001";
constexpr const char* kReply = "03020005";

using testing::ElementsAre;
using testing::IsEmpty;

}  // namespace

TEST(Matcher, PairsARequestWithTheReplyAfterIt) {
    Line line;
    line.say(10ms, 31, kRead);
    EXPECT_THAT(line.told(), IsEmpty());
    line.say(3ms, 31, kReply);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> 03020005"));
    const Transaction& made = line.transactions[0];
    EXPECT_EQ(made.replied - made.sent, 3ms);
    EXPECT_EQ(made.sampled, made.asked);
    EXPECT_THAT(line.frames, ElementsAre(FrameKind::heard_request, FrameKind::reply));
}

TEST(Matcher, PairsAnExceptionToo) {
    Line line;
    line.say(10ms, 31, kRead);
    line.say(3ms, 31, "8302");
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> 8302"));
}

TEST(Matcher, TakesAnEchoForTheReplyToAWrite) {
    for (const char* write : {"0500B4FF00", "0600640007", "160004 00F2 0025", "0800001234"}) {
        Line line;
        line.say(10ms, 5, write);
        line.say(3ms, 5, write);
        line.say(50ms, 5, kRead);
        EXPECT_THAT(line.told(), testing::SizeIs(1)) << write;
        EXPECT_EQ(line.transactions.at(0).end, End::answered) << write;
        EXPECT_FALSE(line.transactions.at(0).doubtful) << write;
    }
}

TEST(Matcher, PairsSeveralWritesWithTheirShortReplies) {
    Line line;
    line.say(10ms, 5, "10 0064 0002 04 000A 0102");
    line.say(3ms, 5, "10 0064 0002");
    line.say(3ms, 5, "0F 0013 000A 02 CD01");
    line.say(3ms, 5, "0F 0013 000A");
    EXPECT_THAT(line.told(), ElementsAre("5: 100064000204000a0102 -> 1000640002",
                                         "5: 0f0013000a02cd01 -> 0f0013000a"));
}

TEST(Matcher, FindsFramesThatAnAdapterHasJoined) {
    Line line;
    line.hear(10ms, adu(31, kRead) + adu(31, kReply) + adu(5, "0600640007") + adu(5, "0600640007") +
                        adu(0, "0600640007") + adu(31, kRead));
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300640001 -> 03020005", "5: 0600640007 -> 0600640007",
                            "0: 0600640007 -> unasked"));
}

TEST(Matcher, DoesNotTakeTheBeginningOfARequestForAReply) {
    Line line;
    line.say(10ms, 4, "0302A6000F");  // its CRC ends with 00: without that a reply of one register
    line.say(3ms, 4, "831E");
    EXPECT_THAT(line.told(), ElementsAre("4: 0302a6000f -> 831e"));
}

TEST(Matcher, KnowsThatABroadcastHasNoAnswer) {
    Line line;
    line.say(10ms, 0, "0600640007");
    EXPECT_THAT(line.told(), ElementsAre("0: 0600640007 -> unasked"));
    line.say(100ms, 5, "0800040000");
    EXPECT_THAT(line.told(), ElementsAre("5: 0800040000 -> unasked"));
}

TEST(Matcher, ReportsARequestWithoutAReplyWhenTheNextOneComes) {
    Line line;
    line.say(10ms, 31, kRead);
    line.say(500ms, 5, kRead);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent"));
    line.say(3ms, 5, kReply);
    EXPECT_THAT(line.told(), ElementsAre("5: 0300640001 -> 03020005"));
}

TEST(Matcher, ReportsItAfterAWhileWhenNoneComes) {
    Line line;
    line.say(10ms, 31, kRead);
    line.wait(9s);
    EXPECT_THAT(line.told(), IsEmpty());
    line.wait(2s);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent"));
}

TEST(Matcher, ReportsADamagedReply) {
    Line line;
    Bytes reply = adu(31, kReply);
    reply[4] ^= 1;
    line.say(10ms, 31, kRead);
    line.hear(3ms, reply);
    line.say(500ms, 31, kRead);
    line.say(3ms, 31, kReply);
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300640001 -> damaged", "31: 0300640001 -> 03020005"));
}

TEST(Matcher, StepsOverBytesThatBelongToNoFrame) {
    Line line;
    line.hear(10ms, Bytes{0xFF, 0x00} + adu(31, kRead) + Bytes{0x55} + adu(31, kReply) +
                        Bytes{0x00, 0xFE, 0x1F});
    line.hear(20ms, adu(5, kRead));
    line.hear(3ms, adu(5, kReply));
    line.wait(1s);
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300640001 -> 03020005", "5: 0300640001 -> 03020005"));
}

TEST(Matcher, ListensOnBehindAHeaderThatPromisesTooMuch) {
    Line line;
    line.say(10ms, 31, kRead);
    line.hear(3ms, Bytes{31, 0x10, 0, 0, 0, 100, 200, 1, 2, 3});  // would take 209 bytes
    for (int i = 0; i < 20; ++i) {
        line.say(4ms, 5, kRead);
        line.say(3ms, 5, kReply);
    }
    line.wait(1s);
    EXPECT_EQ(line.transactions.front().end, End::damaged);
    EXPECT_EQ(line.transactions.size(), 21u);
}

TEST(Matcher, WaitsForTheRestOfAReplyWithAHole) {
    Line line;
    const Bytes reply = adu(31, kReply);
    line.say(10ms, 31, kRead);
    line.hear(3ms, Bytes(reply.begin(), reply.begin() + 3));
    line.hear(50ms, Bytes(reply.begin() + 3, reply.end()));
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> 03020005"));
}

TEST(Matcher, DoesNotTakeAFrameInsideAReplyForOne) {
    Line line;
    const Bytes inner = adu(5, "0600640007");
    Bytes outer{3, 8};
    outer = outer + inner;
    line.say(10ms, 31, "0300640004");
    line.hear(3ms, modbus::encode_adu(31, outer));
    EXPECT_EQ(line.told().size(), 1u);
    EXPECT_EQ(line.transactions[0].reply, outer);
}

TEST(Matcher, DoesNotGiveALateReplyToTheNextRequest) {
    Line line;
    line.say(10ms, 31, "0300640001");
    line.say(200ms, 31, "0300C80001");
    line.say(30ms, 31, "03020064");  // which of them?
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300640001 -> silent", "31: 0300c80001 -> 03020064 ?"));
}

TEST(Matcher, GivesAReplyToTheSameRequestOnceMore) {
    Line line;
    line.say(10ms, 31, kRead);
    line.say(200ms, 31, kRead);
    line.say(3ms, 31, kReply);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent", "31: 0300640001 -> 03020005"));
    EXPECT_EQ(line.transactions[1].sampled, line.transactions[0].asked);  // not newer than that
}

TEST(Matcher, IsSureAgainWhenRepliesKeepTheUsualTime) {
    Line line;
    for (int i = 0; i < 3; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(3ms, 31, "03020064");
    }
    line.say(10ms, 31, "0300640001");
    line.say(200ms, 31, "0300C80001");
    line.told();
    line.say(3ms, 31, "030200C8");
    line.say(10ms, 31, "0300640001");
    line.say(3ms, 31, "03020064");
    line.say(10ms, 31, "0300C80001");
    line.say(3ms, 31, "030200C8");
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300c80001 -> 030200c8 ?", "31: 0300640001 -> 03020064",
                            "31: 0300c80001 -> 030200c8"));
}

TEST(Matcher, DistinguishesALateReplyAndADuplicateFromOthers) {
    Line line;
    line.say(10ms, 31, "0300640001");
    line.say(200ms, 31, "0300C80002");
    line.say(3ms, 31, "03020005");  // of one register
    line.say(3ms, 31, "030400050006");
    line.say(3ms, 31, "030400050006");
    line.say(3ms, 7, "03020001");
    line.wait(1s);  // it could go on as a request
    EXPECT_THAT(line.told(),
                ElementsAre("31: 0300640001 -> silent", "31: 0300c80002 -> 030400050006"));
    EXPECT_THAT(line.frames,
                ElementsAre(FrameKind::heard_request, FrameKind::heard_request, FrameKind::late,
                            FrameKind::reply, FrameKind::copy, FrameKind::foreign));
}

TEST(Matcher, DistinguishesARepeatedWriteFromItsEchoByTheTime) {
    Line line;
    for (int i = 0; i < 3; ++i) {  // this master gives up after 300 ms
        line.say(10ms, 9, kRead);
        line.say(300ms, 5, kRead);
        line.say(3ms, 5, kReply);
    }
    line.told();
    line.say(10ms, 5, "0600640007");
    line.say(300ms, 5, "0600640007");
    line.say(3ms, 5, "0600640007");
    EXPECT_THAT(line.told(), ElementsAre("5: 0600640007 -> silent", "5: 0600640007 -> 0600640007"));
}

TEST(Matcher, DecidesByWhatFollowsWhereTheTimeDoesNot) {
    Line line;
    line.say(10ms, 5, "0600640007");
    line.say(150ms, 5, "0600640007");
    EXPECT_THAT(line.told(), IsEmpty());
    line.say(5ms, 31, kRead);  // no master gives up after that
    EXPECT_THAT(line.told(), ElementsAre("5: 0600640007 -> 0600640007"));
    Line other;
    other.say(10ms, 5, "0600640007");
    other.say(150ms, 5, "0600640007");
    other.say(5ms, 5, "0600640007");
    EXPECT_THAT(other.told(),
                ElementsAre("5: 0600640007 -> silent", "5: 0600640007 -> 0600640007 ?"));
}

TEST(Matcher, IsInDoubtOfAnEchoWhoseRequestCameDamaged) {
    Line line;
    Bytes request = adu(5, "0600640007");
    request[4] ^= 0x10;
    line.hear(10ms, request);
    line.say(3ms, 5, "0600640007");
    line.say(10ms, 31, kRead);
    EXPECT_THAT(line.told(), ElementsAre("5: 0600640007 -> silent ?"));
}

TEST(Matcher, CutsFunctionsWithoutALengthByTheSilenceBehindThem) {
    Line line;
    line.say(10ms, 5, "41 0102");
    line.say(3ms, 5, "41 AABBCC");
    line.say(10ms, 31, kRead);
    line.say(3ms, 31, kReply);
    EXPECT_THAT(line.told(), ElementsAre("5: 410102 -> 41aabbcc", "31: 0300640001 -> 03020005"));
    Line joined;
    joined.hear(10ms, adu(5, "41 0102") + adu(5, "41 AABBCC"));
    joined.wait(1s);
    EXPECT_THAT(joined.told(), ElementsAre("5: 410102 -> 41aabbcc"));
}

TEST(Matcher, ForgetsWhatIsOpenWhenTheLineIsLost) {
    Line line;
    line.say(10ms, 31, kRead);
    line.lose();
    line.say(3ms, 31, kReply);
    line.wait(1s);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent ?"));
    EXPECT_EQ(line.frames.back(), FrameKind::foreign);
}

TEST(Matcher, HoldsLittleOfALineThatBabbles) {
    Line line;
    Bytes noise(5000, 0x11);  // station 17, function 17: a request's length is known
    line.hear(10ms, noise);
    line.wait(1s);
    std::size_t told = 0;
    for (const FrameKind kind : line.frames) told += kind == FrameKind::damaged ? 1u : 0u;
    EXPECT_GE(told, 9u);
    EXPECT_THAT(line.told(), IsEmpty());
}
