// What stations that do not answer, or not in time, may cost (P4).
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter::arbiter_health_test {
namespace {

/// Takes station 17 offline.
void silence(BusScript& bus, const Bytes& request = kRead) {
    while (!bus.arbiter().health(17).offline()) {
        if (bus.arbiter().idle()) bus.submit(17, request, 7);
        bus.run_for(100ms);
    }
}

TEST_F(ArbiterTest, P4AfterThreeSilentTransactionsTheAnswerIsImmediate) {
    for (int i = 0; i < 3; ++i) {
        const Ticket ticket = bus.submit(17, kRead);
        bus.run_for(3s);
        EXPECT_EQ(bus.answer(ticket).pdu.error(), Fault::timeout);
    }
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::offline);
    const std::size_t frames = bus.sent.size();
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    EXPECT_EQ(bus.sent.size(), frames);
}

TEST_F(ArbiterTest, P4AStationThatHasNeverAnsweredIsProbedWithWhatIsWanted) {
    silence(bus, kWrite);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    EXPECT_EQ(bus.next_sent().value().kind, FrameKind::probe);
    EXPECT_EQ(bus.sent.back().adu, modbus::encode_adu(17, kRead)) << "it may answer nothing else";
}

TEST_F(ArbiterTest, P4QueuedRequestsOfAStationThatGoesOfflineAreAnsweredAtOnce) {
    settings.queue.deadline = 60s;
    BusScript script{settings};
    std::vector<Ticket> tickets;
    for (unsigned i = 0; i < 6; ++i) tickets.push_back(script.submit(17, read_at(i), i + 1));
    while (!script.arbiter().health(17).offline()) script.run_for(10ms);
    for (const Ticket ticket : tickets) EXPECT_TRUE(script.answered(ticket));
    EXPECT_EQ(script.answer(tickets[5]).pdu.error(), Fault::offline);
    EXPECT_FALSE(script.answer(tickets[5]).transmitted);
}

TEST_F(ArbiterTest, P4ProbesOfASilentStationStayBelowTheirShareAndOneReplyBringsItBack) {
    silence(bus);
    const std::size_t before = bus.sent.size();
    const Duration busy = bus.arbiter().counters().busy;
    bus.run_for(1000s);
    EXPECT_GT(bus.sent.size(), before + 10) << "it is asked again and again";
    EXPECT_LT(to_seconds(bus.arbiter().counters().busy - busy), 0.05 * 1000);
    answer_next(bus, 17, kReply);
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::online);
    const Ticket ticket = bus.submit(17, kRead);
    ASSERT_TRUE(bus.next_sent(1s));
    answer(bus, 17, kReply);
    EXPECT_TRUE(bus.answer(ticket).pdu.has_value());
}

TEST_F(ArbiterTest, P4AWriteMayBeTheProbeOnceAnInterval) {
    bus.submit(17, kRead);
    answer(bus, 17, kReply, 3ms);
    silence(bus);
    bus.run_for(20s);
    EXPECT_EQ(bus.try_submit(17, kRead).error(), Fault::offline);
    const Ticket write = bus.submit(17, kWrite);
    EXPECT_EQ(bus.try_submit(17, kWrite).error(), Fault::offline);
    while (bus.sent.back().adu[1] != 6) ASSERT_TRUE(bus.next_sent());
    answer(bus, 17, kWrite, 3ms);
    EXPECT_EQ(bus.answer(write).pdu.value(), kWrite);
    EXPECT_EQ(bus.arbiter().health(17).state(), Health::online);
}

TEST_F(ArbiterTest, P4ADamagedReplyIsNotSilence) {
    for (int i = 0; i < 5; ++i) {
        bus.submit(17, kRead);
        for (int attempt = 0; attempt < 2; ++attempt) {
            if (attempt > 0) ASSERT_TRUE(bus.next_sent());
            bus.run_to_end_of_request();
            bus.hear(ByteView(modbus::encode_adu(17, kReply)).first(6));
        }
        bus.run_for(30ms);
    }
    EXPECT_FALSE(bus.arbiter().health(17).offline());
}

TEST_F(ArbiterTest, P4ASilenceWhoseRetryIsNotAwaitedCountsAllTheSame) {
    bus.submit(17, read_at(1), 1);
    ASSERT_EQ(bus.sent.size(), 1u);
    bus.submit(18, read_at(2), 2);
    ASSERT_EQ(bus.next_sent().value().adu[0], 18) << "another one goes first";
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 0);
    bus.cancel(1);
    EXPECT_EQ(bus.arbiter().health(17).silent_in_a_row(), 1);
}

TEST_F(ArbiterTest, AnAdaptiveTimeoutAnswersTheClientEarlyAndStillWaitsForALateReply) {
    settings.stations.clear();
    settings.unlisted.adaptive_timeout = true;
    settings.unlisted.retries = 0;
    BusScript script(settings);
    for (int i = 0; i < 20; ++i) {
        script.submit(17, kRead);
        answer(script, 17, kReply, 3ms);
        script.run_for(3ms);
    }
    EXPECT_LT(script.arbiter().response_timeout(17), Duration(40ms));
    const Ticket silent = script.submit(17, kRead, 1);
    const TimePoint start = script.now();
    const Ticket other = script.submit(18, kRead, 2);
    const auto next = script.next_sent();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->adu[0], 18) << "the others need not wait for the whole timeout";
    EXPECT_LT(next->at - start, Duration(100ms));
    EXPECT_TRUE(script.answered(silent));
    answer(script, 18, kReply, 3ms);
    EXPECT_TRUE(script.answered(other));
    script.submit(17, kRead, 1);
    EXPECT_EQ(script.next_sent().value().kind, FrameKind::probe)
        << "another length shows what is late";
    EXPECT_GT(script.next_sent().value().at - start, Duration(900ms)) << "where it is not answered";
}

/// One client reads station 18, four others read and write station 17, which does not answer each
/// `nth` request. Returns the answers of 18 in half a minute.
int answers_beside_silence(BusScript& bus, int nth) {
    std::multimap<TimePoint, Bytes> replies;
    std::map<Client, Ticket> asked;
    std::size_t seen = 0;
    unsigned number = 0;
    int good = 0;
    const TimePoint end = bus.now() + 30s;
    const auto ask = [&](Client client) {
        if (asked.contains(client) && !bus.answered(asked[client])) return;
        ++number;
        if (client == 1) good += asked.contains(client) ? 1 : 0;
        const Bytes write = Writer().u8(6).u16(number % 5000).u16(number).take();
        asked[client] = client == 1   ? bus.submit(18, kRead, client)
                        : client == 2 ? bus.submit(17, read_at(number % 100), client)
                                      : bus.submit(17, write, client);
    };
    int requests = 0;
    while (bus.now() < end) {
        for (Client client = 1; client <= 5; ++client) ask(client);
        bus.run_for(1ms);
        for (; seen < bus.sent.size(); ++seen) {
            const Bytes& adu = bus.sent[seen].adu;
            if (adu[0] == 17 && ++requests % nth == 0) continue;
            const ByteView pdu = modbus::pdu_of(adu);
            replies.emplace(bus.sent[seen].at + 8ms,
                            Writer().u8(adu[0]).raw(pdu[0] == 3 ? ByteView(kReply) : pdu).take());
        }
        for (; !replies.empty() && replies.begin()->first <= bus.now();
             replies.erase(replies.begin())) {
            const Bytes& reply = replies.begin()->second;
            bus.hear_reply(reply[0], ByteView(reply).subspan(1));
        }
    }
    return good;
}

TEST_F(ArbiterTest, P4APanelThatMissesEachSecondToFourthRequestLeavesTheOthersTheLine) {
    settings.stations[0].response_timeout = 300ms;
    for (const int nth : {2, 3, 4}) {
        BusScript script{settings};
        EXPECT_GT(answers_beside_silence(script, nth), 250) << nth;
    }
}

/// The panel answers each read that is sent in two halves, until this one is answered.
void serve_in_halves(BusScript& bus, Ticket asked, Duration pause) {
    for (std::size_t served = bus.sent.size() - 1; !bus.answered(asked); bus.run_for(1ms)) {
        if (served == bus.sent.size()) continue;
        served = bus.sent.size();
        const Bytes& request = bus.sent.back().adu;
        Writer reply;
        reply.u8(request[1]).u8(2u * request[5]);
        for (unsigned i = 0; i < request[5]; ++i) reply.u16(i);
        const Bytes adu = modbus::encode_adu(request[0], reply.take());
        bus.run_to_end_of_request();
        bus.run_for(3ms);
        bus.hear(ByteView(adu).first(6));
        bus.run_for(pause);
        bus.hear(ByteView(adu).subspan(6));
    }
}

TEST_F(ArbiterTest, P4APanelThatPausesInsideItsRepliesIsWaitedForFromTheThirdOn) {
    settings.stations[0].retries = 0;
    for (const bool is_known : {false, true}) {
        BusScript line{settings};
        if (is_known) {
            const Ticket quick = line.submit(17, kRead);
            answer(line, 17, kReply);
            EXPECT_TRUE(line.answered(quick));
        }
        for (std::size_t i = 1; i < 10; ++i) {
            const Ticket asked = line.submit(17, read_at(static_cast<unsigned>(i)));
            serve_in_halves(line, asked, 80ms);
            if (i != 2) EXPECT_EQ(line.answer(asked).pdu.has_value(), i > 2) << i << is_known;
        }
    }
}

/// At 1200 baud a reply cannot be seen before 4.5 characters have passed: 41 ms.
class ArbiterAtALowRate : public ArbiterTest {
  protected:
    ArbiterAtALowRate() {
        settings.serial = {1200, 8, Parity::none, 1};
        for (StationSettings& station : settings.stations) station.response_timeout = 1s;
    }
    /// The panel answers 5 ms behind the silence that ends the request.
    void answer_paced(BusScript& script, unsigned number) {
        script.run_to_end_of_request();
        script.run_for(silent_interval(settings.serial) + 5ms);
        script.hear_paced(modbus::encode_adu(17, reply_number(number)));
    }
    void know(BusScript& script, unsigned replies) {
        for (unsigned i = 0; i < replies; ++i) {
            script.run_for(1s);
            script.submit(17, read_at(i));
            answer_paced(script, i);
        }
    }
};

TEST_F(ArbiterAtALowRate, P4AQuickPanelIsWaitedForAsLongAsItNeedsWhereTheTimeoutIsAdaptive) {
    for (StationSettings& station : settings.stations) station.adaptive_timeout = true;
    BusScript script{settings};
    know(script, 40);
    EXPECT_EQ(script.sent.size(), 40u);
}

TEST_F(ArbiterAtALowRate, P4AQuickPanelThatIsBackAnswersTheFirstProbe) {
    BusScript script{settings};
    know(script, 20);
    silence(script);
    ASSERT_TRUE(script.next_sent(10s));
    answer_paced(script, 7);
    EXPECT_FALSE(script.arbiter().health(17).offline());
}

}  // namespace
}  // namespace panelgate::arbiter::arbiter_health_test
