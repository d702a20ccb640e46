#include "panelgate/tap/matcher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"

using namespace panelgate;
using namespace panelgate::tap;

namespace {

constexpr SerialFormat kFormat{38400, 8, Parity::none, 1};

Bytes pdu(std::string_view hex) { return *from_hex(hex); }

/// A line that is listened to: who says what, when.
class Line {
  public:
    explicit Line(Settings settings = {kFormat}) : matcher_(settings) {}

    /// A good frame begins so long behind the last byte, and is heard byte by byte.
    void say(Duration pause, std::uint8_t station, std::string_view hex) {
        const Bytes adu = modbus::encode_adu(station, pdu(hex));
        wait(pause);
        for (const std::uint8_t byte : adu) {
            now_ += character_time(kFormat);
            matcher_.on_rx(now_, ByteView(&byte, 1));
        }
        collect();
    }
    /// All of it in one chunk.
    void hear(Duration pause, const Bytes& bytes) {
        wait(pause + wire_time(kFormat, bytes.size()));
        matcher_.on_rx(now_, bytes);
        collect();
    }
    void wait(Duration pause) {
        const TimePoint until = now_ + pause;
        for (auto next = matcher_.next_deadline(); next && *next <= until;
             next = matcher_.next_deadline()) {
            now_ = std::max(now_, *next);
            matcher_.on_deadline(now_);
            collect();
        }
        now_ = until;
    }
    void lose() {
        matcher_.on_line_down(now_);
        collect();
    }
    TimePoint now() const { return now_; }
    /// "1f 03 0000 0001 -> 03 02 00 05": one line each.
    std::vector<std::string> told() { return std::exchange(told_, {}); }
    std::vector<Transaction> transactions;
    std::vector<FrameKind> frames;

  private:
    void collect() {
        while (const auto event = matcher_.poll_action()) {
            if (const auto* frame = std::get_if<Frame>(&*event)) {
                frames.push_back(frame->kind);
                continue;
            }
            const auto& one = std::get<Transaction>(*event);
            transactions.push_back(one);
            told_.push_back(words(one));
        }
    }
    static std::string words(const Transaction& one) {
        static constexpr const char* kEnds[] = {"", "silent", "damaged", "unasked"};
        std::string text = std::to_string(one.station) + ": " + to_hex(one.request, "") + " -> ";
        text += one.end == End::answered ? to_hex(one.reply, "")
                                         : kEnds[static_cast<std::size_t>(one.end)];
        return one.doubtful ? text + " ?" : text;
    }

    Matcher matcher_;
    TimePoint now_{1h};
    std::vector<std::string> told_;
};

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

TEST(Matcher, PairsARequestWithTheReplyBehindIt) {
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

TEST(Matcher, KnowsThatNobodyAnswersABroadcast) {
    Line line;
    line.say(10ms, 0, "0600640007");
    EXPECT_THAT(line.told(), ElementsAre("0: 0600640007 -> unasked"));
    line.say(100ms, 5, "0800040000");
    EXPECT_THAT(line.told(), ElementsAre("5: 0800040000 -> unasked"));
}

TEST(Matcher, TellsARequestWithoutAReplyWhenTheNextOneComes) {
    Line line;
    line.say(10ms, 31, kRead);
    line.say(500ms, 5, kRead);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent"));
    line.say(3ms, 5, kReply);
    EXPECT_THAT(line.told(), ElementsAre("5: 0300640001 -> 03020005"));
}

TEST(Matcher, TellsItAfterAWhileWhenNoneComes) {
    Line line;
    line.say(10ms, 31, kRead);
    line.wait(9s);
    EXPECT_THAT(line.told(), IsEmpty());
    line.wait(2s);
    EXPECT_THAT(line.told(), ElementsAre("31: 0300640001 -> silent"));
}

TEST(Matcher, TellsADamagedReply) {
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

TEST(Matcher, AMasterThatALateReplyDisturbsHasNotGivenUpByTime) {
    Line line;
    for (int i = 0; i < 4; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(5ms, 31, "03020064");
        line.say(10ms, 31, "0300640001");
        line.say(500ms, 31, "0300C80002");  // its timeout
        line.say(50ms, 31, "03020065");     // late, and no answer to that: it is an error at once
        line.say(80ms, 5, "0300640001");
        line.say(5ms, 5, "03020064");
    }
    line.wait(6s);
    line.told();
    for (const Duration think : {150ms, 170ms, 200ms, 160ms}) {
        line.say(10ms, 31, "0300640001");
        line.say(think, 31, "03020064");
    }
    const std::string good = "31: 0300640001 -> 03020064";
    EXPECT_THAT(line.told(), ElementsAre(good, good, good, good));
}

TEST(Matcher, FollowsAMasterThatWaitsLongerThanItDid) {
    Line line;
    for (int i = 0; i < 10; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(140ms, 5, "0300640001");  // given up
        line.say(5ms, 5, "03020064");
    }
    line.wait(6s);
    line.told();
    for (int i = 0; i < 8; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(150ms + 10ms * (i % 3), 31, "03020064");
    }
    const std::string good = "31: 0300640001 -> 03020064";
    EXPECT_THAT(line.told(),
                ElementsAre(good + " ?", good + " ?", good + " ?", good, good, good, good, good));
}

/// A master that waits for 500 ms, takes what has the right length, and a panel that is silent or
/// late as often as not.
class Trouble {
  public:
    Trouble(Line& line, unsigned seed) : line_(line), random_(seed) {}

    void go_on() {
        for (int i = 0; i < 120; ++i) {
            const Exchange& asked = kExchanges[random_() % 3];
            line_.say(1ms * (5 + random_() % 60), 31, asked.request);
            let_answer(asked.reply);
            hear(asked.reply, line_.now() + 500ms);
        }
        while (!coming_.empty()) hear("", line_.now() + 1s);
        line_.wait(100ms);
    }
    /// Each reply comes late, and in time.
    void calm_down(int exchanges) {
        for (int i = 0; i < exchanges; ++i) {
            const Exchange& asked = kExchanges[random_() % 3];
            line_.say(20ms, 31, asked.request);
            line_.say(1ms * (150 + random_() % 50), 31, asked.reply);
        }
    }

  private:
    struct Exchange {
        std::string_view request;
        std::string_view reply;
    };
    static constexpr std::array<Exchange, 3> kExchanges{
        {{"0300640001", "03020064"}, {"0300C80002", "030400C800C9"}, {"03012C0001", "0302012C"}}};

    void let_answer(std::string_view reply) {
        const unsigned fate = random_() % 10;
        if (fate < 2) return;
        const Duration think =
            fate < 6 ? 1ms * (5 + random_() % 60) : 1ms * (400 + random_() % 500);
        coming_.emplace(line_.now() + think, reply);
    }
    void hear(std::string_view expected, TimePoint until) {
        while (!coming_.empty() && coming_.begin()->first < until) {
            const auto [at, reply] = *coming_.begin();
            coming_.erase(coming_.begin());
            line_.say(std::max<Duration>(at - line_.now(), 2ms), 31, reply);
            if (reply.size() == expected.size() || random_() % 2 == 0) return;
        }
        line_.wait(std::max<Duration>(until - line_.now(), Duration::zero()));
    }

    Line& line_;
    std::mt19937 random_;
    std::multimap<TimePoint, std::string_view> coming_;
};

TEST(Matcher, BelievesSlowRepliesAgainWhateverTroubleThereWas) {
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

TEST(Matcher, TellsALateReplyAndACopyFromOthers) {
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

TEST(Matcher, KnowsAWriteThatIsSaidAgainFromItsEchoByTheTime) {
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

TEST(Matcher, KnowsItByWhatFollowsWhereTheTimeDoesNotTell) {
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
