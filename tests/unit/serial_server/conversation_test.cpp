#include "conversation.hpp"

#include <gmock/gmock.h>

#include <optional>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::conversation_test {
namespace {

using testing::AnyOf;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

struct Row {
    const char* script;
    const char* told;
};

void expect(const Row& row, EchoMode echo) {
    SCOPED_TRACE(row.script);
    Talk talk(Talk::rtu(echo));
    talk.play(row.script);
    EXPECT_EQ(talk.told, row.told);
    EXPECT_THAT(talk.sent, Each(AnyOf(kReply, modbus::encode_adu(kOurs + 1, kOneValue),
                                      modbus::encode_adu(kOurs, kWrite))));
}

constexpr Row kRows[] = {
    // An answer is given once, to a retry the answer of the first.
    {"read 50 answer answer 10000", "ask 31, reply 31"},
    {"read 300 read 20 answer 1000", "ask 31, reply 31"},
    // The master has asked for something else: an answer would be taken for the other's.
    {"read 300 next old 1000", "ask 31, withdraw, ask 32"},
    {"read 300 next old 1000 answer", "ask 31, withdraw, ask 32, reply 32"},
    {"read 300 foreign 50 answer 1000", "ask 31, withdraw"},
    {"read 300 damaged 100 answer 1000", "ask 31, withdraw"},
    // The answer comes while the master transmits; 16 ms are an adapter's pause.
    {"read 300 write/5 answer 16 rest 1000", "ask 31, withdraw, ask 31"},
    // A glitch of the transceiver is no request.
    {"read glitch 1 answer 100", "ask 31, reply 31"},
    // A request whose function has come is waited for.
    {"read/2 50 rest", "ask 31"},
    // A pause in the header of another unit's data, in which there is a request.
    {"foreign-data/2 50 rest 1000", ""},
    {"foreign-data/3 50 rest 1000", ""},
    {"foreign-data/4 50 rest 1000", ""},
    {"foreign-data/2 50 rest 1000 read", "ask 31"},
    {"foreign-data/3 50 rest 1000 read", "ask 31"},
    {"foreign-data/4 50 rest 1000 read", "ask 31"},
    // Unobserved time is no silence, behind which the request would be valid.
    {"noise-read +10 noise 1000", ""},
    {"noise-read +5000 noise 1000", ""},
    // A broadcast is forwarded once and gets no reply.
    {"broadcast 1000", "forward 06 00 01 00 02"},
    // Everything is forgotten when the device goes.
    {"read read/4 lost answer back read 1000", "ask 31, withdraw, ask 31"},
};

TEST(Conversation, AnswersWhatTheMasterStillWaitsFor) {
    for (const Row& row : kRows) expect(row, EchoMode::off);
}

constexpr Row kEchoRows[] = {
    // The echo of a write is not a request.
    {"write 10 answer echo~ 1000", "ask 31, reply 31"},
    {"write 10 answer echo~ 1000 write 10 answer", "ask 31, reply 31, ask 31, reply 31"},
    // ... when the process was stalled, too.
    {"write 10 answer +5000 echo 1000", "ask 31, reply 31"},
    // One that collided with the master is not absent.
    {"read 10 answer collided-echo~ 1000 write 10 answer echo~ 1000",
     "ask 31, reply 31, ask 31, reply 31"},
    // One that is known to be absent hides no retry: the reply was damaged at the master. What was
    // done just now is not done again (P2).
    {"read 10 answer 1000 write 10 answer 40 write 100",
     "ask 31, reply 31, ask 31, reply 31, reply 31"},
    {"read 10 answer 1000 write 10 answer 40 write 40 write 40 write 40 write 40 write",
     "ask 31, reply 31, ask 31, reply 31, reply 31, reply 31, reply 31, reply 31, ask 31"},
    {"read 10 answer 1000 write 10 answer 200 write 10 answer",
     "ask 31, reply 31, ask 31, reply 31, ask 31, reply 31"},
    {"read 10 answer 1000 write 10 answer 20 read 10 answer 20 write",
     "ask 31, reply 31, ask 31, reply 31, ask 31, reply 31, ask 31"},
    // No master has sent this: it has come before the reply was out.
    {"read 10 answer 1000 write 10 answer 5 echo 1000", "ask 31, reply 31, ask 31, reply 31"},
    // One that may be a retry hides it once at most.
    {"write 10 answer 15 write", "ask 31, reply 31"},
    {"write 10 answer 15 write 500 write", "ask 31, reply 31, ask 31"},
    // It comes behind the master's next request, and in one piece with it.
    {"write 10 answer 20 read write 10 answer 1000", "ask 31, reply 31, ask 31, reply 31"},
    {"write 10 answer 20 read/5 1 rest+write 10 answer 1000", "ask 31, reply 31, ask 31, reply 31"},
    // Now and then: what has come once may come again.
    {"read 10 answer 1000 read 10 answer 30 echo 1000 write 10 answer 1000 write 10 answer 30 echo",
     "ask 31, reply 31, ask 31, reply 31, ask 31, reply 31, ask 31, reply 31"},
};

TEST(Conversation, TakesItsOwnEchoForNoRequest) {
    for (const Row& row : kEchoRows) expect(row, EchoMode::automatic);
    // An echo only begun: the master's request begins as the reply did.
    expect({"read 10 answer 20 read~", "ask 31, reply 31, ask 31"}, EchoMode::on);
    Talk talk(Talk::rtu(EchoMode::automatic));
    for (int i = 0; i < 3; ++i) talk.play("read 10 answer echo~ 100");
    EXPECT_THAT(talk.sent, SizeIs(3));
    EXPECT_EQ(talk.machine.counters().damaged, 0u);
}

TEST(Conversation, AsksAtTheLastByteAndRepliesBehindTheSilence) {
    Talk talk;
    talk.play("read");
    ASSERT_THAT(talk.asks, SizeIs(1));
    EXPECT_EQ(talk.asks[0].adu, (modbus::SerialAdu{kOurs, kReadOne}));
    const TimePoint ended = talk.now;
    talk.play("answer");
    EXPECT_THAT(talk.sent, IsEmpty());
    talk.play("1000 read 50 answer");
    ASSERT_THAT(talk.sent, ElementsAre(kReply, kReply));
    EXPECT_EQ(talk.sent_at[0], ended + silent_interval(Talk::rtu().device.serial));
    EXPECT_EQ(talk.sent_at[1], talk.now) << "at once: the silence has passed";
}

TEST(Conversation, SendsNothingBehindTheMastersTimeout) {
    Settings settings = Talk::rtu();
    settings.response_timeout = 200ms;
    Talk talk(settings);
    talk.play("read 200 answer 1000");
    EXPECT_EQ(talk.told, "ask 31");
    EXPECT_EQ(talk.machine.counters().late, 1u);
    talk.play("read 190 answer");
    EXPECT_EQ(talk.told, "ask 31, ask 31, reply 31");
}

TEST(Conversation, AnswersFailuresWithSilence) {
    Talk talk;
    talk.play("read 10 read fail 1000");
    EXPECT_EQ(talk.told, "ask 31");
    EXPECT_EQ(talk.machine.counters().repeated, 1u);
    EXPECT_EQ(talk.machine.counters().silent, 1u);
    EXPECT_FALSE(talk.machine.busy());
}

TEST(Conversation, AsksNothingMoreOnceItFinishes) {
    Talk talk;
    talk.play("read");
    talk.machine.finish();
    talk.play("10 answer 10 read broadcast");
    EXPECT_EQ(talk.told, "ask 31, reply 31");
    EXPECT_FALSE(talk.machine.busy());
}

TEST(Conversation, SpeaksAscii) {
    Settings settings = Talk::rtu();
    settings.access.framing = modbus::Framing::ascii;
    Talk talk(settings);
    talk.hear_slowly(modbus::encode_ascii(kOurs, kReadOne), 300ms);
    ASSERT_THAT(talk.asks, SizeIs(1));
    talk.play("answer 1000");
    EXPECT_THAT(talk.sent, ElementsAre(modbus::encode_ascii(kOurs, kOneValue)));
    talk.hear({':', '1'});
    talk.pass(10s);
    EXPECT_EQ(talk.machine.counters().damaged, 1u);
    EXPECT_EQ(talk.machine.next_deadline(), std::nullopt);
}

TEST(Conversation, WantsNothingWhenNothingHappens) {
    Talk talk;
    EXPECT_EQ(talk.machine.next_deadline(), std::nullopt);
    talk.hear({0x12, 0x34, 0x56, 0x78, 0x9A});
    talk.pass(10s);
    EXPECT_EQ(talk.machine.next_deadline(), std::nullopt);
}

}  // namespace
}  // namespace panelgate::serial_server::test::conversation_test
