// What is reported: counters, shares, names, and with `explain` each transaction and decision.
#include "panelgate/arbiter/outbox.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/attempts.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::outbox_test {
namespace {

class OutboxTest : public testing::Test {
  protected:
    Attempt answered(Group group) const {
        return test::answered(now - 30ms, now, std::move(group), kReply);
    }
    static modbus::Unused frame_of(std::uint8_t station) {
        return {modbus::Unused::Kind::foreign, station, Bytes(6)};
    }
    const StationCounters& of(std::uint8_t station) const { return outbox.stations().at(station); }

    Settings settings = settings_38400();
    Outbox outbox{settings};
    TimePoint now{1h};
};

TEST_F(OutboxTest, AnAnswerSaysWhetherItsRequestWasEverSent) {
    Job job{.ticket = 5, .request = test::request_of(kRead)};
    outbox.finish(job, Fault::timeout);
    job.attempts = 1;
    outbox.finish(job, kReply, true);
    outbox.finish_from_memory(6, kReply, 3s);
    const auto never = std::get<Finish>(*outbox.poll());
    EXPECT_EQ(never.ticket, 5u);
    EXPECT_FALSE(never.transmitted);
    const auto shared = std::get<Finish>(*outbox.poll());
    EXPECT_TRUE(shared.transmitted);
    EXPECT_TRUE(shared.shared);
    EXPECT_FALSE(shared.age);
    const auto remembered = std::get<Finish>(*outbox.poll());
    EXPECT_FALSE(remembered.transmitted);
    EXPECT_EQ(remembered.age, Duration(3s));
}

TEST_F(OutboxTest, UnlistedStationsShareOneAccount) {
    outbox.on_unsolicited(now, frame_of(98), Done::late, 17, false, 5ms);
    outbox.on_unsolicited(now, frame_of(99), Done::late, 17, false, 5ms);
    EXPECT_EQ(of(0).late_frames, 2u);
    EXPECT_EQ(of(17).late_frames, 0u);
    EXPECT_EQ(outbox.stations().size(), 3u) << "no stranger can add one";
}

TEST_F(OutboxTest, EachCollisionIsCountedAndReportedOnceIn10Seconds) {
    outbox.on_echo_mismatch(now, 17);
    EXPECT_TRUE(outbox.poll());
    outbox.on_echo_mismatch(now + 9s, 17);
    EXPECT_FALSE(outbox.poll());
    outbox.on_echo_mismatch(now + 10s, 17);
    EXPECT_TRUE(outbox.poll());
    EXPECT_EQ(of(17).echo_mismatches, 3u);
}

TEST_F(OutboxTest, ATransactionCostsFromItsFirstBitToTheGapBehindItButNotAClientThatHasLeft) {
    Group group = test::group_of(17, kRead);
    group.jobs.push_back(group.jobs.front());
    group.jobs[1].client = 2;
    group.on_client_gone(2);
    const Attempt attempt = answered(group);
    outbox.on_ended(now, attempt, 2ms);
    EXPECT_EQ(outbox.line().busy, now - attempt.timing().started + 2ms);
    const auto& shares = outbox.shares().all();
    ASSERT_EQ(shares.size(), 1u);
    EXPECT_EQ(shares.at(1).busy, outbox.line().busy / 2) << "its half is nobody's";
    outbox.on_client_gone(1);
    EXPECT_TRUE(outbox.shares().all().empty());
}

/// With `explain`: each transaction's number, its instants, and its end.
class ExchangeTest : public testing::Test {
  protected:
    static Settings explained(bool explain = true) {
        Settings made = settings_38400();
        made.explain = explain;
        made.paced = true;
        return made;
    }
    /// Asks 17; the reply comes byte by byte 8 ms after a request without a lead.
    static void answer_one(BusScript& script) {
        script.submit(17, kRead);
        script.run_to_end_of_request();
        script.run_for(8ms);
        script.hear_paced(modbus::encode_adu(17, kReply));
        script.run_for(20ms);
    }
    std::vector<std::string> ends() const {
        std::vector<std::string> words;
        for (const Exchange& one : bus.exchanges) words.emplace_back(label(one.end));
        return words;
    }

    BusScript bus{explained()};
};

TEST_F(ExchangeTest, ReportsTheInstantsOfATransaction) {
    const TimePoint asked = bus.now();
    bus.arbiter().set_lead(3ms);
    answer_one(bus);
    ASSERT_EQ(bus.exchanges.size(), 1u);
    const Exchange& told = bus.exchanges[0];
    EXPECT_EQ(told.transaction, 1u);
    EXPECT_EQ(told.station, 17);
    EXPECT_EQ(told.end, TransactionEnd::ok);
    EXPECT_EQ(told.arrived, asked);
    EXPECT_EQ(told.granted, bus.sent[0].at);
    EXPECT_EQ(told.first_bit_out, told.granted + 3ms);
    const SerialFormat& serial = bus.settings().serial;
    EXPECT_EQ(told.last_bit_out - told.first_bit_out, frame_time(serial, 8));
    EXPECT_NEAR(to_milliseconds(*told.first_byte_in - told.last_bit_out), 5, 0.3);
    EXPECT_NEAR(to_milliseconds(*told.last_byte_in - *told.first_byte_in),
                to_milliseconds(frame_time(serial, 11)), 0.3);
}

TEST_F(ExchangeTest, EachAttemptIsATransactionAndTheAnswerNamesThemAll) {
    const Ticket ticket = bus.submit(17, kRead);
    bus.run_for(3s);
    EXPECT_EQ(ends(), (std::vector<std::string>{"timeout", "timeout"}));
    EXPECT_EQ(bus.answer(ticket).transactions, (std::vector<Transaction>{1, 2}));
    EXPECT_FALSE(bus.exchanges[0].first_byte_in);
    const Ticket other = bus.submit(18, kRead);
    answer(bus, 18, "83 02"_hex, 5ms);
    bus.run_for(20ms);
    EXPECT_EQ(bus.answer(other).transactions, std::vector<Transaction>{3});
    EXPECT_EQ(ends().back(), "exception");
}

TEST_F(ExchangeTest, ReportsWhatWasDamagedWrongBroadcastOrLost) {
    Settings settings = explained();
    settings.stations[0].retries = settings.stations[1].retries = 0;
    bus.apply(settings);
    bus.submit(17, kRead);
    bus.run_to_end_of_request();
    bus.run_for(5ms);
    bus.hear("11 03 06 02 2B 00 00 00 64 C8 BB"_hex);
    bus.run_for(2s);
    bus.submit(18, kRead);
    answer(bus, 18, "84 01"_hex, 5ms);
    bus.run_for(2s);
    bus.submit(0, kWrite);
    bus.run_for(1s);
    bus.submit(18, kRead);
    bus.line_down();
    EXPECT_EQ(ends(), (std::vector<std::string>{"damaged", "wrong", "ok", "line_down"}));
    EXPECT_EQ(bus.exchanges[2].station, 0);
    EXPECT_TRUE(bus.exchanges[0].first_byte_in);
}

TEST_F(ArbiterTest, ExplainsWhyEachRequestGoesNowAndWhyOneIsRefused) {
    settings.explain = true;
    settings.quarantine = Quarantine::line;
    settings.queue.per_client = 1;
    settings.stations[0].retries = settings.stations[1].retries = 0;
    BusScript script(settings);
    script.submit(17, kRead, 1);
    script.submit(18, kRead, 2);
    EXPECT_FALSE(script.try_submit(18, "03 00 00 00 03"_hex, 2));
    EXPECT_EQ(script.notes[0].why.kind, Reason::Kind::turn);
    EXPECT_EQ(script.notes[0].why.client, 1u);
    ASSERT_EQ(script.decisions.size(), 1u);
    EXPECT_EQ(script.decisions[0].kind, Decision::Kind::full);
    EXPECT_EQ(script.decisions[0].client, 2u);
    EXPECT_EQ(script.decisions[0].count, 1u);
    script.run_for(3s);
    ASSERT_GE(script.decisions.size(), 2u);
    EXPECT_EQ(script.decisions[1].kind, Decision::Kind::line_rests);
    EXPECT_EQ(script.decisions[1].station, 17);
    EXPECT_EQ(script.decisions[1].time, 2 * 500ms - kSilence);
}

}  // namespace
}  // namespace panelgate::arbiter::outbox_test
