// What echoes, broadcasts and answers with another address must not do.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::echoes_and_broadcasts_test {
namespace {

using modbus::encode_adu;

class EchoesAndBroadcasts : public ArbiterTest {
  protected:
    EchoesAndBroadcasts() {
        for (StationSettings& station : settings.stations) station.retries = 0;
    }
    static void hear_echo(BusScript& line) {
        const Bytes adu = line.sent.back().adu;
        line.hear_paced(adu);
    }
};

// P8 T6 T3
TEST_F(EchoesAndBroadcasts, TwoBytesOf00InFrontOfTheEchoConfirmAWriteOfAPanelThatIsOff) {
    for (const EchoMode mode : {EchoMode::automatic, EchoMode::on}) {
        settings.echo = mode;
        BusScript line{settings};
        line.submit(17, kRead);
        hear_echo(line);
        answer(line, 17, kReply, 3ms);
        line.run_for(10ms);
        ASSERT_EQ(line.arbiter().echo(), EchoState::present);
        const Ticket write = line.submit(17, "06 00 05 00 00"_hex);
        line.hear_paced(Writer().raw("00 00"_hex).raw(line.sent.back().adu).take());
        line.run_for(2s);
        EXPECT_FALSE(line.answer(write).pdu);
    }
}

// P8 T6 T9: the line has an echo; it is learned that there is none, then an echo confirms.
TEST_F(EchoesAndBroadcasts, ADamagedEchoGluedBehindAnotherMastersRequestShowsNoMissingEcho) {
    settings.echo = EchoMode::automatic;
    BusScript line{settings};
    line.submit(17, kRead);
    line.run_to_end_of_request();
    Bytes echo = line.sent.back().adu;
    echo[3] ^= 0x10;
    line.hear_paced(Writer().raw(encode_adu(18, "04 00 01 00 02"_hex)).raw(echo).take());
    line.hear_paced(encode_adu(17, kReply));
    EXPECT_EQ(line.arbiter().echo(), EchoState::unknown);
    line.run_for(200ms);
    const Ticket write = line.submit(17, kWrite);
    hear_echo(line);
    line.run_for(2s);
    ASSERT_TRUE(line.answered(write));
    EXPECT_FALSE(line.answer(write).pdu);
}

// T11: the station was never asked before.
TEST_F(EchoesAndBroadcasts, TheAnswerToABroadcastConfirmsAWriteToAStationThatWasNeverAsked) {
    BusScript line{settings};
    line.submit(0, kToAll, 1, PriorityClass::write);
    line.run_to_end_of_request();
    const Ticket write = line.submit(17, kToOne, 2, PriorityClass::write);
    line.run_for(150ms);
    line.hear_reply(17, kConfirmed);
    line.run_for(50ms);
    EXPECT_FALSE(line.answered(write) && line.answer(write).pdu);
}

// T14: likewise.
TEST_F(EchoesAndBroadcasts, AfterWriteHoldsBehindABroadcastAStationThatWasNeverAsked) {
    settings.stations[0].after_write = 1s;
    BusScript line{settings};
    line.submit(0, kWrite);
    line.run_to_end_of_request();
    const TimePoint left = line.now();
    line.submit(17, kRead);
    EXPECT_GE(line.next_sent().value().at, left + 1s);
}

// T6: once, not twice.
TEST_F(EchoesAndBroadcasts, AnEchoThatTheConfigurationDeniesIsCountedOnce) {
    settings.echo = EchoMode::off;
    BusScript line{settings};
    line.submit(17, kRead);
    hear_echo(line);
    answer(line, 17, kReply, 3ms);
    line.run_for(100ms);
    EXPECT_EQ(line.arbiter().station_counters().at(17).symptoms.echoes, 1u);
}

// T13: the answer of another address is a "second panel" where that one was read lately.
TEST_F(EchoesAndBroadcasts,
       TheAnswerWithAnotherAddressIsMisaddressedAlsoWhereThatAddressWasReadLately) {
    BusScript line{settings};
    line.submit(18, kRead);
    answer(line, 18, kReply, 3ms);
    line.run_for(400ms);
    line.submit(17, kRead);
    answer(line, 18, reply_number(7), 3ms);
    line.run_for(1s);
    EXPECT_EQ(line.arbiter().station_counters().at(17).symptoms.misaddressed, 1u);
}

}  // namespace
}  // namespace panelgate::arbiter::echoes_and_broadcasts_test
