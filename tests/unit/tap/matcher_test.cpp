#include "panelgate/tap/matcher.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <random>
#include <string>
#include <string_view>

#include "heard_line.hpp"
#include "panelgate/base/bytes.hpp"

namespace panelgate::tap::test::matcher_test {
namespace {

using testing::ElementsAre;

struct Row {
    const char* heard;
    const char* told;
};

constexpr Row kRows[] = {
    // A request is open until its reply comes, normal or an exception.
    {"10 31:read", ""},
    {"10 31:read, 3 31:value", "31: read -> value"},
    {"10 31:read, 3 31:8302", "31: read -> 8302"},
    // Writes of several items have short replies.
    {"10 5:100064000204000a0102, 3 5:1000640002, 3 5:0f0013000a02cd01, 3 5:0f0013000a",
     "5: 100064000204000a0102 -> 1000640002; 5: 0f0013000a02cd01 -> 0f0013000a"},
    // The reply to other writes is their echo.
    {"10 5:write, 3 5:write, 50 5:read", "5: write -> write"},
    {"10 5:0500b4ff00, 3 5:0500b4ff00, 50 5:read", "5: 0500b4ff00 -> 0500b4ff00"},
    {"10 5:16000400f20025, 3 5:16000400f20025, 50 5:read", "5: 16000400f20025 -> 16000400f20025"},
    {"10 5:0800001234, 3 5:0800001234, 50 5:read", "5: 0800001234 -> 0800001234"},
    // A broadcast has no reply, nor has 08/0004.
    {"10 0:write", "0: write -> unasked"},
    {"10 5:0800040000", "5: 0800040000 -> unasked"},
    // An adapter joins frames.
    {"10 31:read+31:value+5:write+5:write+0:write+31:read",
     "31: read -> value; 5: write -> write; 0: write -> unasked"},
    // This CRC ends with 00: without that it is a reply of one register.
    {"10 4:0302a6000f, 3 4:831e", "4: 0302a6000f -> 831e"},
    // No reply: it is told when the next request comes, or after a while.
    {"10 31:read, 500 5:read", "31: read -> silent"},
    {"10 31:read, 500 5:read, 3 5:value", "31: read -> silent; 5: read -> value"},
    {"10 31:read, 9000 silence", ""},
    {"10 31:read, 11000 silence", "31: read -> silent"},
    // A good frame of another function, or of another length.
    {"10 31:read, 3 31:04020005, 10 5:read, 3 5:value", "31: read -> wrong; 5: read -> value"},
    {"10 31:read, 3 31:030400050006, 10 5:read, 3 5:value", "31: read -> wrong; 5: read -> value"},
    // A damaged reply.
    {"10 31:read, 3 31:value!, 500 31:read, 3 31:value", "31: read -> damaged; 31: read -> value"},
    // Bytes that belong to no frame.
    {"10 ~ff00+31:read+~55+31:value+~00fe1f, 20 +5:read, 3 +5:value, 1000 silence",
     "31: read -> value; 5: read -> value"},
    // Whose reply is it? A late one is not given to the next request without a doubt.
    {"10 31:read, 200 31:other, 30 31:value", "31: read -> silent; 31: other -> value ?"},
    // The master has given up after 300 ms three times: then this is no echo.
    {"10 9:read, 300 5:read, 3 5:value, 10 9:read, 300 5:read, 3 5:value, 10 9:read, 300 5:read, "
     "3 5:value, 10 5:write, 300 5:write, 3 5:write",
     "9: read -> silent; 5: read -> value; 9: read -> silent; 5: read -> value; "
     "9: read -> silent; 5: read -> value; 5: write -> silent; 5: write -> write"},
    // Where the time does not tell an echo, what follows does: no master gives up after 5 ms.
    {"10 5:write, 150 5:write", ""},
    {"10 5:write, 150 5:write, 5 31:read", "5: write -> write"},
    {"10 5:write, 150 5:write, 5 5:write", "5: write -> silent; 5: write -> write ?"},
    // An echo whose request came damaged.
    {"10 5:write!, 3 5:write, 10 31:read", "5: write -> silent ?"},
    // Functions without a length end by the silence behind them.
    {"10 5:410102, 3 5:41aabbcc, 10 31:read, 3 31:value",
     "5: 410102 -> 41aabbcc; 31: read -> value"},
    {"10 5:410102+5:41aabbcc, 1000 silence", "5: 410102 -> 41aabbcc"},
};

/// As many of them, apart by "; ".
std::string times(int count, const std::string& what) {
    std::string all = what;
    for (int i = 1; i < count; ++i) all += "; " + what;
    return all;
}

void expect(const std::string& heard, const std::string& told) {
    Line line;
    line.play(heard);
    line.settle();
    EXPECT_EQ(line.told(), told) << heard;
}

TEST(Matcher, TellsWhatBelongsTogether) {
    for (const Row& row : kRows) expect(row.heard, row.told);
    // A hole in a reply, and a frame inside one.
    const std::string reply = to_hex(bytes_of("31:value"), "");
    expect("10 31:read, 3 ~" + reply.substr(0, 6) + ", 50 ~" + reply.substr(6),
           "31: read -> value");
    const std::string values = "0308" + to_hex(bytes_of("5:write"), "");
    expect("10 31:0300640004, 3 +31:" + values, "31: 0300640004 -> " + values);
}

TEST(Matcher, TellsWhenItWas) {
    Line line;
    line.play("10 31:read, 3 31:value");
    line.settle();
    const Transaction& made = line.transactions.at(0);
    EXPECT_EQ(made.replied - made.sent, 3ms);
    EXPECT_EQ(made.sampled, made.asked);
    EXPECT_THAT(line.frames, ElementsAre(FrameKind::heard_request, FrameKind::reply));
    Line again;
    again.play("10 31:read, 200 31:read, 3 31:value");
    again.settle();
    EXPECT_EQ(again.told(), "31: read -> silent; 31: read -> value");
    EXPECT_EQ(again.transactions[1].sampled, again.transactions[0].asked) << "not newer than that";
}

TEST(Matcher, ListensOnBehindAHeaderThatPromisesTooMuch) {
    Line line;
    line.play("10 31:read, 3 ~1f1000000064c8010203");  // would take 209 bytes
    for (int i = 0; i < 20; ++i) line.play("4 5:read, 3 5:value");
    line.wait(1s);
    EXPECT_EQ(line.transactions.front().end, End::damaged);
    EXPECT_EQ(line.transactions.size(), 21u);
}

/// One that is not answered, and a panel that goes on as ever, or is one behind: who can tell?
constexpr const char* kOneBehind =
    "10 31:read, 3 31:03020064, 10 31:other, 3 31:030200c8, 10 31:read, 200 31:other, "
    "3 31:03020064, 10 31:read, 3 31:030200c8, 10 31:read, 3 31:03020064, 10 31:other, "
    "3 31:03020064, 10 5:read, 3 5:value";

TEST(Matcher, BelievesNoReplyWhileOneFewerHasComeThanWasAskedFor) {
    Line line;
    line.play(kOneBehind);
    EXPECT_EQ(line.told(),
              "31: read -> 03020064; 31: other -> 030200c8; 31: read -> silent; "
              "31: other -> 03020064 ?; 31: read -> 030200c8 ?; 31: read -> 03020064 ?; "
              "31: other -> 03020064 ?");
    // A reply of another length: the station serves in turn, and none is behind it any more.
    line.play("10 31:0300640002, 3 31:030400640065, 10 31:read, 3 31:03020064, 10 5:read");
    EXPECT_EQ(line.told(),
              "5: read -> value; 31: 0300640002 -> 030400640065; 31: read -> 03020064");
    // Or the window of the one without is over.
    line.play(kOneBehind);
    line.told();
    line.wait(5s);
    line.play("10 31:read, 3 31:03020064, 10 31:other, 3 31:030200c8, 10 5:read");
    EXPECT_EQ(line.told(), "5: read -> value; 31: read -> 03020064; 31: other -> 030200c8");
}

TEST(Matcher, KnowsThatNoneIsBehindWhenTheLateOneCame) {
    Line line;
    line.play("10 31:read, 200 31:other, 3 31:03020064, 3 31:030200c8, 10 31:read, 3 31:03020065");
    line.settle();
    EXPECT_EQ(line.told(), "31: read -> silent; 31: other -> 03020064 ?; 31: read -> 03020065");
}

TEST(Matcher, OwesNoReplyThatCameDamaged) {
    Line line;
    line.play("10 31:read, 3 31:value!, 300 31:other, 3 31:030200c8");
    line.settle();
    EXPECT_EQ(line.told(), "31: read -> damaged; 31: other -> 030200c8");
}

TEST(Matcher, ExpectsAReplyBehindAnExceptionThatAnnouncesIt) {
    Line line;
    line.play("10 31:read, 3 31:8305, 10 31:other, 3 31:03020064, 3 31:030200c8");
    line.play("10 31:read, 3 31:8302, 10 31:other, 3 31:030200c8, 10 5:read");
    EXPECT_EQ(line.told(),
              "31: read -> 8305; 31: other -> 03020064 ?; 31: read -> 8302; 31: other -> 030200c8");
}

TEST(Matcher, BelievesNeitherOfTwoAnswers) {
    Line line;
    line.play("10 31:read, 3 31:03020064, 10 31:other, 3 31:03020064, 3 31:030200c8");
    line.play("10 31:read, 3 31:03020064, 3 31:03020065, 10 5:read");
    EXPECT_EQ(line.told(), "31: read -> 03020064; 31: other -> 03020064 ?; 31: read -> 03020064 ?");
    // From then on one that repeats another is no value by itself.
    line.play("3 5:value, 10 31:other, 3 31:030200c8, 10 31:read, 3 31:030200c8, 10 5:read");
    EXPECT_EQ(line.told(), "5: read -> value; 31: other -> 030200c8; 31: read -> 030200c8 ?");
    Line other;  // its panels hold the same, and send nothing twice
    other.play("10 31:read, 3 31:value, 10 31:other, 3 31:value, 10 31:read, 3 31:value");
    other.settle();
    EXPECT_EQ(other.told(), "31: read -> value; 31: other -> value; 31: read -> value");
}

/// A read of 24 coils, and its reply, which is the read of 24 coils from 768.
TEST(Matcher, TakesNoReadForTheReplyToARead) {
    const std::string known =
        "10 5:0101000018, 6 5:0103ffffff, 10 5:0103000018, 6 5:0103fffffe, 10 5:read, 6 5:value, ";
    const std::string told =
        "5: 0101000018 -> 0103ffffff; 5: 0103000018 -> 0103fffffe; "
        "5: read -> value; 5: 0101000018 -> ";
    expect(known + "10 5:0101000018, 20 5:0103000018, 6 5:0103fffffe",
           told + "silent; 5: 0103000018 -> 0103fffffe ?");
    expect(known + "10 5:0101000018, 6 5:0103000018, 20 5:read, 6 5:value",
           told + "0103000018 ?; 5: read -> value");
    expect(known + "10 5:0101000018, 20 5:0103000018, 20 5:0103000018, 6 5:0103fffffe",
           told + "silent; 5: 0103000018 -> silent; 5: 0103000018 -> 0103fffffe ?");
    // Never asked before: at the usual time it is a reply.
    expect(known + "10 5:0101000018, 6 5:0103010018, 10 5:read, 6 5:value",
           told + "0103010018; 5: read -> value");
    expect(known + "10 5:0101000018, 25 5:0103010018, 6 5:0103fffffe",
           told + "silent; 5: 0103010018 -> 0103fffffe ?");
    expect(known + "10 5:0101000018, 25 5:0103010018, 20 5:read, 6 5:value",
           told + "0103010018 ?; 5: read -> value");
}

TEST(Matcher, TakesNoRepeatedWriteForItsEcho) {
    const std::string known = "10 5:read, 6 5:value, 10 5:read, 6 5:value, ";
    const std::string told = "5: read -> value; 5: read -> value; 5: write -> ";
    expect(known + "10 5:write, 6 5:write, 500 5:read", told + "write");
    expect(known + "10 5:write, 25 5:write, 500 5:read", told + "write ?");
    expect(known + "10 5:write, 25 5:write, 10 5:read", told + "write");
    expect(known + "10 5:write, 25 5:write, 25 5:write, 500 5:read",
           told + "silent; 5: write -> write ?");
    expect("10 5:write, 25 5:write, 500 5:read", "5: write -> write ?");
}

/// A repeater gives each request back: no panel and no master is so quick.
TEST(Matcher, TakesNoCopyOfARequestForItsReply) {
    // 24 coils: the request has the form of their values.
    const std::string coils = "10 5:0103000018, 2 5:0103000018, ";
    expect(coils + "150 5:read, 6 5:value", "5: 0103000018 -> 0103000018 ?; 5: read -> value");
    expect(coils + "4 5:0103fffffe, 50 5:read",
           "5: 0103000018 -> silent; 5: 0103000018 -> 0103fffffe");
    // A write, where a read was heard twice.
    const std::string known = "10 5:read, 6 5:value, 10 5:read, 6 5:value, 10 5:read, 6 5:value, ";
    const std::string copied = known + "10 5:0300640002, 2 5:0300640002, 4 5:030400640065, ";
    const std::string told =
        times(3, "5: read -> value") +
        "; 5: 0300640002 -> silent; 5: 0300640002 -> 030400640065; 5: write -> ";
    expect(copied + "20 5:write, 2 5:write, 150 5:read", told + "write ?");
    expect(copied + "20 5:write, 6 5:write, 2 5:read", told + "write ?");
    expect(copied + "20 5:write, 2 5:write, 4 5:write, 50 5:read",
           told + "silent; 5: write -> write ?");
    // No reply fits in between: the line gives requests back, whatever is known of its panels.
    expect("10 7:read, 2 7:read, 50 5:write, 2 5:write, 150 5:read",
           "7: read -> silent; 7: read -> silent; 5: write -> write ?");
    expect("10 7:read, 5 7:read, 50 5:write, 2 5:write, 150 5:read",
           "7: read -> silent; 7: read -> silent; 5: write -> write");
    // Or sooner than its panel has ever answered, which it may do with writes as a rule.
    Line line;
    for (int i = 0; i < 33; ++i) line.play("20 5:read, 6 5:value");
    line.settle();
    line.told();
    for (int i = 0; i < 5; ++i) line.play("20 5:write, 2 5:write, 150 7:read, 6 7:value");
    line.settle();
    EXPECT_EQ(line.told(), times(3, "5: write -> write ?; 7: read -> value") + "; " +
                               times(2, "5: write -> write; 7: read -> value"));
}

/// What was not heard may have been asked after the open request.
TEST(Matcher, BelievesNoReplyBehindTheRestOfARequest) {
    const std::string known = "10 31:read, 6 31:value, ";
    const std::string told = "31: read -> value; 31: read -> ";
    for (const char* const rest : {"~4500c4c2", "~044500", "~4500", "~45"}) {
        for (const char* const pause : {"20 ", "100 ", "400 "})
            expect(known + "10 31:read, " + pause + rest + ", 6 31:03020064, 300 silence",
                   told + "03020064 ?");
    }
    // At the panel's usual time its master still waits for it: noise.
    expect(known + "10 31:read, 3 ~ff, 1 31:03020064", told + "03020064");
    // A slow panel that begins with noise is believed when it has always done so.
    Line line;
    for (int i = 0; i < 12; ++i) line.play("20 31:read, 80 ~ff, 0 31:value");
    line.settle();
    EXPECT_EQ(line.told(), times(8, "31: read -> value ?") + "; " + times(4, "31: read -> value"));
}

TEST(Matcher, TakesNoAnswerToABroadcastForThatToAWrite) {
    const std::string to_all = "10 0:100064000102000a, ";
    const std::string ignored = "280 5:100064000102000b, 8 5:1000640001, ";
    const std::string told = "5: read -> value; 0: 100064000102000a -> unasked; ";
    const std::string doubt = "5: 100064000102000b -> 1000640001 ?";
    const std::string known = "10 5:read, 6 5:value, ";
    expect(known + to_all + ignored + "100 silence", told + doubt);
    // One had no answer: then none has.
    const std::string none = known + to_all + "6000 silence, 0 5:read, 6 5:value, ";
    expect(none + to_all + ignored + "100 silence",
           told + told + "5: 100064000102000b -> 1000640001");
    // One that has had an answer may have it again.
    expect(known + to_all + "300 5:1000640001, 6000 silence, 0 5:read, 6 5:value, " + to_all +
               ignored + "100 silence",
           told + told + doubt);
    expect(none + to_all + "300 5:1000640001, 10 5:read, 6 5:value, " + to_all + ignored +
               "100 silence",
           told + told + told + doubt);
    // Another place, or long after it.
    expect(known + to_all + "280 5:100066000102000b, 8 5:1000660001, 100 silence",
           told + "5: 100066000102000b -> 1000660001");
    expect(known + to_all + "5000 silence, " + ignored + "100 silence",
           told + "5: 100064000102000b -> 1000640001");
}

TEST(Matcher, DistinguishesALateReplyAndADuplicateFromOthers) {
    Line line;
    line.play("10 31:read, 200 31:0300c80002, 3 31:value, 3 31:030400050006, 3 31:030400050006");
    line.play("3 7:03020001, 1000 silence");  // it could go on as a request
    EXPECT_EQ(line.told(), "31: read -> silent; 31: 0300c80002 -> 030400050006");
    EXPECT_THAT(line.frames,
                ElementsAre(FrameKind::heard_request, FrameKind::heard_request, FrameKind::late,
                            FrameKind::reply, FrameKind::copy, FrameKind::foreign));
}

TEST(Matcher, ForgetsWhatIsOpenWhenTheLineIsLost) {
    Line line;
    line.play("10 31:read, 0 lost, 3 31:value, 1000 silence");
    EXPECT_EQ(line.told(), "31: read -> silent ?");
    EXPECT_EQ(line.frames.back(), FrameKind::foreign);
}

TEST(Matcher, HoldsLittleOfALineThatBabbles) {
    Line line;
    line.hear(10ms, Bytes(5000, 0x11));  // station 17, function 17: a request's length is known
    line.wait(1s);
    EXPECT_GE(std::ranges::count(line.frames, FrameKind::damaged), 9);
    EXPECT_EQ(line.told(), "");
}

TEST(Patience, AMasterThatALateReplyDisturbsHasNotGivenUpByTime) {
    Line line;
    for (int i = 0; i < 4; ++i) {
        line.play("10 31:read, 5 31:value, 10 31:read, 500 31:0300c80002");  // its timeout
        line.play("50 31:03020065");  // late, and no answer to that: it is an error at once
        line.play("80 5:read, 5 5:value");
    }
    line.wait(6s);
    line.told();
    line.play("10 31:read, 150 31:value, 10 31:read, 170 31:value");
    line.play("10 31:read, 200 31:value, 10 31:read, 160 31:value");
    line.wait(400ms);
    EXPECT_EQ(line.told(), times(4, "31: read -> value"));
}

TEST(Patience, FollowsAMasterThatWaitsLongerThanItDid) {
    Line line;
    for (int i = 0; i < 10; ++i) line.play("10 31:read, 140 5:read, 5 5:value");  // given up
    line.wait(6s);
    line.told();
    for (const char* think : {"150", "160", "170", "150", "160", "170", "150", "160"})
        line.play(std::string("10 31:read, ") + think + " 31:value");
    line.wait(400ms);
    EXPECT_EQ(line.told(), times(3, "31: read -> value ?") + "; " + times(5, "31: read -> value"));
}

/// A master that waits for 500 ms, takes what has the right length, and a panel that is silent or
/// late as often as not.
class Trouble {
  public:
    Trouble(Line& line, unsigned seed) : line_(line), random_(seed) {}

    void go_on() {
        for (int i = 0; i < 120; ++i) {
            const Exchange& asked = next();
            line_.say(1ms * (5 + random_() % 60), asked.request);
            let_answer(asked.reply);
            hear(asked.reply, line_.now() + 500ms);
        }
        while (!coming_.empty()) hear("", line_.now() + 1s);
        line_.wait(100ms);
    }
    /// Each reply comes late, and in time.
    void calm_down(int exchanges) {
        for (int i = 0; i < exchanges; ++i) {
            const Exchange& asked = next();
            line_.say(20ms, asked.request);
            line_.say(1ms * (150 + random_() % 50), asked.reply);
        }
    }

  private:
    struct Exchange {
        std::string_view request;
        std::string_view reply;
    };
    static constexpr Exchange kExchanges[] = {
        {"31:0300640001", "31:03020064"},
        {"31:0300c80002", "31:030400c800c9"},
        {"31:03012c0001", "31:0302012c"},
    };

    /// Not the last request's: a late reply belongs to another request.
    const Exchange& next() { return kExchanges[last_ = (last_ + 1 + random_() % 2) % 3]; }
    void let_answer(std::string_view reply) {
        const unsigned fate = random_() % 10;
        if (fate < 2) return;
        const Duration think =
            fate < 6 ? 1ms * (5 + random_() % 60) : 1ms * (500 + random_() % 400);
        coming_.emplace(line_.now() + think, reply);
    }
    void hear(std::string_view expected, TimePoint until) {
        while (!coming_.empty() && coming_.begin()->first < until) {
            const auto [at, reply] = *coming_.begin();
            coming_.erase(coming_.begin());
            line_.say(std::max<Duration>(at - line_.now(), 2ms), reply);
            if (reply.size() == expected.size() || random_() % 2 == 0) return;
        }
        line_.wait(std::max<Duration>(until - line_.now(), Duration::zero()));
    }

    Line& line_;
    std::mt19937 random_;
    std::size_t last_ = 0;
    std::multimap<TimePoint, std::string_view> coming_;
};

TEST(Patience, BelievesSlowRepliesAgainWhateverTroubleThereWas) {
    for (unsigned seed = 0; seed < 100; ++seed) {
        Line line;
        Trouble trouble(line, seed);
        trouble.go_on();
        trouble.calm_down(60);
        line.transactions.clear();
        trouble.calm_down(50);
        ASSERT_EQ(line.transactions.size(), 50u) << seed;
        EXPECT_EQ(std::ranges::count(line.transactions, true, &Transaction::doubtful), 0) << seed;
    }
}

}  // namespace
}  // namespace panelgate::tap::test::matcher_test
