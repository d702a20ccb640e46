// A bus carries requests to its line and answers each once.
#include "panelgate/bus/bus.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "answers.hpp"
#include "bus_case.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/rt/clock.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::bus::bus_test {
namespace {

class AnswersTest : public testing::Test {
  protected:
    /// Appends its name when it is answered.
    Delivery to(char name) {
        return {[this, name](const Answer&) { delivered += name; }, {}};
    }
    /// What was delivered by the end of the loop's next turn.
    std::string run() {
        io.restart();
        io.poll();
        return delivered;
    }

    boost::asio::io_context io{1};
    std::optional<Answers> answers{io.get_executor()};
    std::string delivered;
};

TEST_F(AnswersTest, GoOutOnceAndInTheirOrderWhenTheCallIsOverOrTheLoopSaysSo) {
    answers->add(to('a'), false);
    answers->add(to('b'), true);
    EXPECT_EQ(delivered, "");
    answers->deliver();
    EXPECT_EQ(delivered, "ab");
    EXPECT_EQ(run(), "ab") << "once";
    answers->add(to('c'), false);
    answers->add(to('d'), false);
    EXPECT_EQ(delivered, "ab");
    EXPECT_EQ(run(), "abcd");
    EXPECT_EQ(run(), "abcd") << "once";
    answers->add(to('e'), false);
    answers.reset();
    EXPECT_EQ(run(), "abcde") << "what is left after its end";
}

TEST_F(AnswersTest, WhatAnAnswerLeadsToIsAnsweredLaterAndItMayEndThem) {
    answers->add({[this](const Answer&) {
                      delivered += 'a';
                      answers->add(to('b'), false);
                      answers->add(to('c'), true);
                      answers->deliver();
                      delivered += '.';
                  },
                  {}},
                 true);
    answers->deliver();
    EXPECT_EQ(delivered, "a.");
    EXPECT_EQ(run(), "a.bc");
    answers->add({[this](const Answer&) {
                      delivered += 'd';
                      answers.reset();
                  },
                  {}},
                 true);
    answers->add(to('e'), true);
    answers->deliver();
    EXPECT_EQ(delivered, "a.bcde");
}

/// The oven is guarded against function 6.
class BusTest : public BusCase {
  protected:
    BusTest() {
        settings.device = "memory";
        settings.arbiter.queue.deadline = 200ms;
        settings.arbiter.offline.after = 5;
        settings.stations[18].name = "oven";
        settings.stations[18].guard = [](const modbus::Request& request) {
            return request.function() == 6 ? std::optional(Objection{Rule::range, "no memory"})
                                           : std::nullopt;
        };
        settings.observe = [this](const BusEvent& event) {
            const auto* line_event = std::get_if<LineEvent>(&event);
            if (line_event != nullptr && !line_event->why.empty()) seen += line_event->why + '\n';
        };
        start_bus();
    }
    void forbid_writes_to_press() {
        settings.stations[17].access = Access::read_only;
        start_bus();
    }

    /// Reads a register of press four times at once, the last two as one who takes values out.
    void read_four_times(bool verbatim) {
        answers.clear();
        line->written.clear();
        for (int i = 0; i < 4; ++i)
            bus->transact({.station = 17,
                           .request = test::request_of(kRead),
                           .client = 1,
                           .verbatim = verbatim && i < 2},
                          [this](Answer answer) { answers.push_back(std::move(answer)); });
        EXPECT_TRUE(run_until([&] { return answers.size() == 4; }));
    }

    std::string seen;  ///< causes and findings of line events
    std::vector<Answer> answers;
};

TEST_F(BusTest, P6AReplyOfAnyLengthIsSharedWithNobody) {
    read_four_times(true);
    EXPECT_LT(line->written.size(), 3U) << "one goes out, and the rest share another";
    settings.stations[17].any_length = true;
    start_bus();
    read_four_times(false);
    EXPECT_LT(line->written.size(), 3U) << "whoever takes values out is answered as asked";
    read_four_times(true);
    EXPECT_EQ(line->written.size(), 3U);
    EXPECT_FALSE(answers[0].shared);
    EXPECT_FALSE(answers[1].shared);
}

TEST_F(BusTest, P2WhatWaitsIsNotWrittenOnceTheStationMayOnlyBeRead) {
    for (const std::uint8_t station : Bytes{17, 17, 99, 17}) send(station, kWrite, answers);
    send(17, kRead, answers);
    settings.stations[17].access = Access::read_only;
    bus->apply(settings, nullptr, nullptr);
    ASSERT_TRUE(run_until([&] { return answers.size() == 5; }));
    const Refusal now{Rule::read_only, "press", modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(std::ranges::count(answers, std::optional(now), &Answer::refusal), 3);
    EXPECT_EQ(std::ranges::count(answers, true, &Answer::transmitted), 2) << "99, and a read";
}

TEST_F(BusTest, AGuardedStationIsNotAskedWhatItsProfileRulesOut) {
    const Answer refused = ask(18, kWrite);
    EXPECT_EQ(refused.pdu.value(), (Bytes{0x86, 2}));
    EXPECT_FALSE(refused.transmitted);
    EXPECT_TRUE(line->written.empty());
    EXPECT_EQ(bus->report().stations.back().requests.at(6)[Outcome::refused], 1u);
    const Refusal guarded{Rule::range, "oven", modbus::ExceptionCode::illegal_data_address,
                          "no memory"};
    EXPECT_EQ(refused.refusal, guarded);
    EXPECT_TRUE(ask(18).pdu.has_value());
}

TEST_F(BusTest, WhatARightForbidsIsRefusedWhoeverAsks) {
    forbid_writes_to_press();
    const Answer write = ask(17, kWrite);
    EXPECT_EQ(end_of(write), "denied");
    EXPECT_EQ(write.refusal.value().rule, Rule::read_only);
    EXPECT_EQ(write.refusal->station, "press");
    const Answer broadcast = ask(0, kWrite);
    EXPECT_EQ(end_of(broadcast), "denied");
    EXPECT_EQ(broadcast.refusal.value().rule, Rule::broadcast_over_read_only);
    EXPECT_TRUE(line->written.empty());
    EXPECT_EQ(bus->report().stations[1].requests.at(6)[Outcome::refused], 1u);
    EXPECT_TRUE(ask(17).pdu.has_value());
    EXPECT_FALSE(ask(17).refusal);
}

TEST_F(BusTest, SaysEarlyWhatItWouldRefuse) {
    EXPECT_EQ(bus->write_refusal(17), std::nullopt);
    forbid_writes_to_press();
    EXPECT_EQ(bus->write_refusal(17).value().rule, Rule::read_only);
    EXPECT_EQ(bus->write_refusal(18), std::nullopt) << "its guard wants to see the write";
    EXPECT_EQ(bus->write_refusal(0).value().station, "press");
    EXPECT_TRUE(bus->idle());
}

TEST_F(BusTest, RefusesWhatMayNotBeTransmitted) {
    EXPECT_EQ(end_of(ask(0, kRead)), "denied");
    EXPECT_EQ(end_of(ask(17, "08 00 04 00 00"_hex)), "denied");
    EXPECT_TRUE(line->written.empty());
}

TEST_F(BusTest, AsksALineThatCanTellWhetherTheRequestHasLeft) {
    make_bus();
    line->tells_unsent = true;
    bus->start();
    const int before = line->asked_for_unsent;
    EXPECT_TRUE(ask(17).pdu.has_value());
    EXPECT_FALSE(ask_silent(17).pdu.has_value());
    EXPECT_GT(line->asked_for_unsent, before);
}

TEST_F(BusTest, SaysOnceWhatIsWrongWithTheLineAndOnceThatItIsNoMore) {
    EXPECT_TRUE(bus->status().findings.empty());
    line->reply.clear();
    for (int i = 0; i < 5; ++i) ask(17);  // the first one twice
    ASSERT_EQ(bus->status().findings.size(), 1u);
    const LineFinding finding = bus->status().findings[0];
    EXPECT_EQ(finding.cause, "no-answer-at-all");
    EXPECT_FALSE(finding.station);
    EXPECT_FALSE(finding.text.empty());
    EXPECT_FALSE(finding.advice.empty());
    EXPECT_EQ(finding.evidence, "1 station(s) asked, the last 6 requests without a reply");
    EXPECT_EQ(seen, "finding: no-answer-at-all, station all\n");
    line->reply = kReply;
    EXPECT_TRUE(ask(18).pdu.has_value());
    const auto now = bus->status().findings;
    ASSERT_EQ(now.size(), 1u) << "one answers: it is not the line";
    EXPECT_EQ(now[0].cause, "station-silent");
    EXPECT_EQ(now[0].station, 17);
    EXPECT_EQ(seen,
              "finding: no-answer-at-all, station all\n"
              "finding gone: no-answer-at-all, station all\n"
              "finding: station-silent, station press\n");
}

TEST_F(BusTest, ALineThatWorksHasNoFinding) {
    for (int i = 0; i < 50; ++i) ask(17);
    EXPECT_TRUE(bus->status().findings.empty());
    EXPECT_EQ(seen, "");
}

TEST_F(BusTest, CarriesARequestToTheLineAndTheReplyBack) {
    const WallTime before = rt::wall_now();
    const Answer answer = ask(17);
    EXPECT_EQ(answer.pdu.value(), kReply);
    EXPECT_TRUE(answer.transmitted);
    ASSERT_EQ(line->written.size(), 1u);
    EXPECT_EQ(line->written[0], "11 03 00 6B 00 03 76 87"_hex);
    const auto trace = bus->trace(10).frames;
    ASSERT_EQ(trace.size(), 2u);
    EXPECT_EQ(trace[0].kind, FrameKind::request);
    EXPECT_EQ(trace[1].bytes, "11 03 06 02 2B 00 00 00 64 C8 BA"_hex);
    for (const TraceFrame& frame : trace) {
        EXPECT_GE(frame.time, before - 1s) << "by the clock on the wall";
        EXPECT_LE(frame.time, rt::wall_now() + 1s);
    }
    EXPECT_EQ(bus->station_status(17).state, Health::online);
}

TEST_F(BusTest, SaysWhyInTheTraceAndWhoUsesTheLine) {
    bus->name_client(1, "modbus_tcp 10.0.0.7:5000");
    ask(17);
    const auto frames = bus->trace(10).frames;
    ASSERT_FALSE(frames.empty());
    EXPECT_THAT(frames[0].why,
                ::testing::StartsWith("read of modbus_tcp 10.0.0.7:5000 to station 17: next"));
    const auto clients = bus->clients();
    ASSERT_EQ(clients.size(), 1u);
    EXPECT_EQ(clients[0].name, "modbus_tcp 10.0.0.7:5000");
    EXPECT_EQ(clients[0].transactions, 1u);
    EXPECT_EQ(clients[0].percent, 100);
}

TEST_F(BusTest, NumbersFramesAndDecisionsOfALineTogether) {
    ask(17);
    const TracePart all = bus->trace(100);
    std::set<std::uint64_t> numbers;
    for (const TraceFrame& frame : all.frames) numbers.insert(frame.sequence);
    for (const TraceDecision& decision : all.decisions) numbers.insert(decision.sequence);
    EXPECT_EQ(numbers.size(), all.frames.size() + all.decisions.size());
    EXPECT_EQ(*numbers.begin(), 1u);
    EXPECT_EQ(*numbers.rbegin(), numbers.size());
    ASSERT_GE(all.frames.size(), 2u);
    const auto later = bus->trace_since(all.frames[0].sequence, 1).frames;
    ASSERT_EQ(later.size(), 1u);
    EXPECT_EQ(later[0].sequence, all.frames[1].sequence);
}

TEST_F(BusTest, AnswersLineDownBeforeTheDeviceIsThereAndSaysWhyItIsNot) {
    line->events()->on_down("Permission denied");
    const Answer down = ask(17);
    EXPECT_EQ(end_of(down), "line_down");
    EXPECT_EQ("down: " + down.why, bus->status().state);
    make_bus();
    line->up_at_start = false;
    bus->start();
    EXPECT_EQ(end_of(ask(17)), "line_down");
}

TEST_F(BusTest, GivesPollsReadsAndWritesTheirClass) {
    ask(17, kRead);
    ask(17, kWrite);
    ask(17, "41 00"_hex);
    ask(17, kRead, 1, true);
    ask(17, kWrite, 1, true);
    std::string classes;
    for (const TraceFrame& frame : bus->trace(100).frames) {
        if (frame.kind == FrameKind::request)
            classes += frame.why.substr(0, frame.why.find(' ') + 1);
    }
    EXPECT_EQ(classes, "read write write poll poll ");
}

TEST_F(BusTest, ASilentStationIsATimeoutAndSaysSoInTheStatus) {
    EXPECT_EQ(end_of(ask_silent(17, kWrite)), "timeout, sent");
    EXPECT_EQ(line->written.size(), 1u);
    EXPECT_EQ(bus->station_status(17).state, Health::suspect);
}

TEST_F(BusTest, ABroadcastIsAnsweredWithoutAReply) {
    EXPECT_EQ(ask(0, kWrite).pdu.value(), kWrite);
    EXPECT_EQ(line->written.size(), 1u);
    EXPECT_EQ(line->written[0][0], 0);
}

TEST_F(BusTest, ALineThatIsLostInsideAWriteAnswersOnceAndDoesNotRecurse) {
    line->fail_writes = true;
    EXPECT_EQ(end_of(ask(17, kWrite)), "line_lost, sent");
    EXPECT_FALSE(bus->status().up);
}

TEST_F(BusTest, AnAnswerMaySubmitTheNextRequest) {
    int answered = 0;
    std::function<void()> again = [&] {
        bus->transact({.station = 17, .request = test::request_of(kRead)},
                      [&](const Answer& answer) {
                          EXPECT_TRUE(answer.pdu.has_value());
                          if (++answered < 20) again();
                      });
    };
    again();
    EXPECT_TRUE(run_until([&] { return answered == 20; }));
}

/// The reply arrived while the loop was busy, and the timeout expires before it is read.
TEST_F(BusTest, P1AReplyThatLiesInTheDeviceWhenItsTimeIsOverIsNoTimeout) {
    line->reply.clear();
    send(17, kWrite, answers);
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    clock.advance(1ms);
    line->come(modbus::encode_adu(17, kWrite));
    clock.pass(50ms);
    ASSERT_TRUE(run_until([&] { return !answers.empty(); }));
    EXPECT_EQ(answers[0].pdu.value(), kWrite);
    EXPECT_EQ(bus->station_status(17).state, Health::online);
}

/// Bytes before the request delay it by the gap and answer nothing.
TEST_F(BusTest, P1StaleBytesAreReadBeforeARequestIsSent) {
    clock.advance(1s);
    line->come(modbus::encode_adu(17, "03 06 0B AD 0B AD 0B AD"_hex));
    const TimePoint asked = clock.now();
    send(17, kRead, answers);
    EXPECT_TRUE(line->written.empty()) << "the wire is not quiet yet";
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    EXPECT_GE(clock.now() - asked, silent_interval({1000000, 8, Parity::none, 1}));
    ASSERT_TRUE(run_until([&] { return !answers.empty(); }));
    EXPECT_EQ(answers[0].pdu.value(), kReply);
    EXPECT_EQ(bus->trace(1).frames.front().bytes, modbus::encode_adu(17, kReply));
    EXPECT_EQ(direction_of(bus->trace(10).frames.front().kind), FrameDirection::discarded);
}

TEST_F(BusTest, RefusalsAreHandedOutAMillisecondApart) {
    send(0, kRead, answers);
    send(0, kRead, answers);
    io.poll();
    EXPECT_EQ(answers.size(), 0u);
    clock.advance(1ms);
    EXPECT_EQ(answers.size(), 2u);
    send(0, kRead, answers);
    clock.advance(1ms - 1ns);
    EXPECT_EQ(answers.size(), 2u);
    clock.advance(1ns);
    EXPECT_EQ(answers.size(), 3u);
}

TEST_F(BusTest, StoppingAnswersWhatIsOpen) {
    line->reply.clear();
    for (const Bytes& pdu : {"03 00 00 00 01"_hex, "03 00 10 00 01"_hex, "03 00 20 00 01"_hex})
        send(17, pdu, answers);
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    bus.reset();
    io.restart();
    io.run();
    std::string ends;
    for (const Answer& answer : answers) ends += std::string(label(answer.pdu.error())) + ' ';
    EXPECT_EQ(ends, "line_lost line_down line_down ");
}

TEST_F(BusTest, P10CountsByConfiguredNamesOnly) {
    ask(17);
    ask(99);
    ask(98, "41 00"_hex);
    const LineReport report = bus->report();
    ASSERT_EQ(report.stations.size(), 3u);
    EXPECT_EQ(report.stations[0].station, "other");
    EXPECT_EQ(report.stations[0].requests.at(3)[Outcome::ok], 1u);
    EXPECT_EQ(report.stations[0].requests.at(kOtherFunctions)[Outcome::damaged], 1u);
    EXPECT_EQ(report.stations[1].station, "press");
    EXPECT_EQ(report.stations[1].requests.at(3)[Outcome::ok], 1u);
    EXPECT_EQ(report.stations[1].up, true);
    EXPECT_EQ(report.stations[2].up, std::nullopt);
}

}  // namespace
}  // namespace panelgate::bus::bus_test
