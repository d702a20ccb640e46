#include "conversation.hpp"

#include <gmock/gmock.h>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::conversation_test {
namespace {

using modbus::encode_adu;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const Bytes kRequest = encode_adu(kOurs, kReadOne);
const Bytes kReply = encode_adu(kOurs, kOneValue);
const Duration kSilence = silent_interval(Talk::rtu().device.serial);

TEST(Conversation, AsksAtTheLastByteOfARequest) {
    Talk talk;
    talk.hear(kRequest);
    ASSERT_THAT(talk.asks, SizeIs(1));
    EXPECT_EQ(talk.asks[0].adu.station, kOurs);
    EXPECT_EQ(talk.asks[0].adu.pdu, kReadOne);
}

TEST(Conversation, RepliesNotBeforeTheSilenceBehindTheRequest) {
    Talk talk;
    talk.hear(kRequest);
    const TimePoint ended = talk.now;
    talk.answer(kOneValue);
    EXPECT_THAT(talk.sent, IsEmpty());
    talk.pass(1s);
    ASSERT_THAT(talk.sent, ElementsAre(kReply));
    EXPECT_EQ(talk.sent_at[0], ended + kSilence);
}

TEST(Conversation, RepliesAtOnceWhenTheSilenceHasPassed) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(50ms);
    talk.answer(kOneValue);
    ASSERT_THAT(talk.sent, ElementsAre(kReply));
    EXPECT_EQ(talk.sent_at[0], talk.now);
}

TEST(Conversation, GivesAnswersOnce) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(50ms);
    talk.answer(kOneValue);
    talk.answer(kOneValue);
    talk.pass(10s);
    EXPECT_THAT(talk.sent, SizeIs(1));
}

TEST(Conversation, DropsAnAnswerWhenTheMasterAsksForSomethingElse) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(300ms);
    talk.hear(encode_adu(kOurs + 1, kReadOne));
    EXPECT_EQ(talk.withdrawals, 1);
    ASSERT_THAT(talk.asks, SizeIs(2));
    talk.machine.on_answer(talk.now, talk.asks[0].ticket, kOneValue);
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    talk.answer(kOneValue);
    EXPECT_THAT(talk.sent, ElementsAre(encode_adu(kOurs + 1, kOneValue)));
}

TEST(Conversation, GivesARetryTheAnswerOfTheFirst) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(300ms);
    talk.hear(kRequest);
    EXPECT_THAT(talk.asks, SizeIs(1));
    EXPECT_EQ(talk.withdrawals, 0);
    talk.pass(20ms);
    talk.answer(kOneValue);
    talk.pass(1s);
    EXPECT_THAT(talk.sent, ElementsAre(kReply));
    EXPECT_EQ(talk.machine.counters().repeated, 1u);
}

TEST(Conversation, DefersAReplyWhileTheMasterTransmits) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(300ms);
    const Bytes next = encode_adu(kOurs, modbus::encode_read(modbus::Table::coils, 7, 3));
    talk.hear(Bytes(next.begin(), next.begin() + 5));
    talk.answer(kOneValue);
    talk.pass(16ms);  // an adapter's pause
    talk.hear(Bytes(next.begin() + 5, next.end()));
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    EXPECT_THAT(talk.asks, SizeIs(2));
}

TEST(Conversation, RepliesBehindAGlitchOfTheTransceiver) {
    Talk talk;
    talk.hear(kRequest);
    talk.hear({0x00});
    talk.pass(1ms);
    talk.answer(kOneValue);
    talk.pass(100ms);
    EXPECT_THAT(talk.sent, ElementsAre(kReply));
}

TEST(Conversation, FindsNoRequestInAnotherUnitsDataBehindAPauseInItsHeader) {
    Bytes pdu{0x03, 0x08};
    pdu.insert(pdu.end(), kRequest.begin(), kRequest.end());
    const Bytes reply = encode_adu(kOther, pdu);
    for (const std::size_t first : {2u, 3u, 4u}) {
        Talk talk;
        talk.hear({reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(first)});
        talk.pass(50ms);
        talk.hear({reply.begin() + static_cast<std::ptrdiff_t>(first), reply.end()});
        talk.pass(1s);
        EXPECT_THAT(talk.asks, IsEmpty()) << first;
        talk.hear(kRequest);
        EXPECT_THAT(talk.asks, SizeIs(1)) << first;
    }
}

TEST(Conversation, CountsNoUnobservedTimeAsASilence) {
    for (const Duration late : {10ms, 5000ms}) {
        Talk talk;
        talk.hear(joined({{0x55, 0xAA}, kRequest}));  // valid after noise if a silence follows
        talk.now += late;
        talk.hear({0xC8, 0x57});
        talk.pass(1s);
        EXPECT_THAT(talk.asks, IsEmpty());
    }
}

TEST(Conversation, WaitsForTheRestOfARequestWhoseFunctionHasCome) {
    Talk talk;
    talk.hear({kRequest.begin(), kRequest.begin() + 2});
    talk.pass(50ms);
    talk.hear({kRequest.begin() + 2, kRequest.end()});
    EXPECT_THAT(talk.asks, SizeIs(1));
}

TEST(Conversation, TakesDamageForTheMastersNextRequest) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(300ms);
    Bytes next = encode_adu(kOurs, modbus::encode_read(modbus::Table::holding_registers, 9, 1));
    next[4] ^= 0x10;
    talk.hear(next);
    talk.pass(100ms);
    talk.answer(kOneValue);  // would be taken for the answer of the other
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    EXPECT_EQ(talk.withdrawals, 1);
}

TEST(Conversation, SendsNothingBehindTheMastersTimeout) {
    Settings settings = Talk::rtu();
    settings.response_timeout = 200ms;
    Talk talk(settings);
    talk.hear(kRequest);
    talk.pass(200ms);
    talk.answer(kOneValue);
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    EXPECT_EQ(talk.machine.counters().late, 1u);
    talk.hear(kRequest);
    talk.pass(190ms);
    talk.answer(kOneValue);
    EXPECT_THAT(talk.sent, ElementsAre(kReply));
}

TEST(Conversation, AnswersFailuresWithSilence) {
    Talk talk;
    talk.hear(kRequest);
    talk.answer(std::nullopt);
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    EXPECT_EQ(talk.machine.counters().silent, 1u);
    EXPECT_FALSE(talk.machine.busy());
}

TEST(Conversation, ForwardsABroadcastOnceAndSendsNoReply) {
    Talk talk;
    const Bytes write = modbus::encode_write_register(1, 2);
    talk.hear(encode_adu(0, write));
    talk.pass(1s);
    ASSERT_THAT(talk.spreads, SizeIs(1));
    EXPECT_EQ(talk.spreads[0].adu.pdu, write);
    EXPECT_THAT(talk.asks, IsEmpty());
    EXPECT_THAT(talk.sent, IsEmpty());
}

TEST(Conversation, GivesUpWhatTheMasterHasLeftForAnotherUnit) {
    Talk talk;
    talk.hear(kRequest);
    talk.pass(300ms);
    talk.hear(encode_adu(kOther, kReadOne));
    talk.pass(50ms);
    talk.answer(kOneValue);
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
    EXPECT_EQ(talk.withdrawals, 1);
}

TEST(Conversation, ForgetsEverythingWhenTheDeviceGoes) {
    Talk talk;
    talk.hear(kRequest);
    talk.hear(Bytes(kRequest.begin(), kRequest.begin() + 4));
    talk.machine.on_line_down();
    talk.answer(kOneValue);
    talk.machine.on_line_up();
    talk.hear(kRequest);
    EXPECT_THAT(talk.asks, SizeIs(2));
    talk.pass(1s);
    EXPECT_THAT(talk.sent, IsEmpty());
}

TEST(Conversation, AsksNothingMoreOnceItFinishes) {
    Talk talk;
    talk.hear(kRequest);
    talk.machine.finish();
    talk.pass(10ms);
    talk.answer(kOneValue);
    talk.pass(10ms);
    EXPECT_THAT(talk.sent, SizeIs(1));
    talk.hear(kRequest);
    talk.hear(encode_adu(0, modbus::encode_write_register(1, 2)));
    EXPECT_THAT(talk.asks, SizeIs(1));
    EXPECT_THAT(talk.spreads, IsEmpty());
    EXPECT_FALSE(talk.machine.busy());
}

TEST(Conversation, SpeaksAscii) {
    Settings settings = Talk::rtu();
    settings.access.framing = modbus::Framing::ascii;
    Talk talk(settings);
    talk.hear_slowly(modbus::encode_ascii(kOurs, kReadOne), 300ms);
    ASSERT_THAT(talk.asks, SizeIs(1));
    talk.answer(kOneValue);
    talk.pass(1s);
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
