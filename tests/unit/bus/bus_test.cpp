#include "panelgate/bus/bus.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus::bus_test {
namespace {

const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
const Bytes kWrite = "06 00 01 00 03"_hex;

class BusTest : public testing::Test {
  protected:
    BusTest() {
        settings.name = "floor1";
        settings.device = "memory";
        settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        settings.arbiter.unlisted.response_timeout = 5ms;
        settings.arbiter.queue.deadline = 200ms;
        settings.arbiter.offline.after = 5;
        settings.arbiter.stations = {settings.arbiter.unlisted};
        settings.arbiter.stations[0].id = 17;
        settings.stations[17].name = "press";
        settings.stations[18].name = "oven";
        settings.stations[18].guard = [](const modbus::Request& request) {
            return request.function() == 6 ? std::optional(Objection{Rule::range, "no memory"})
                                           : std::nullopt;
        };
        settings.doctor.rest = {};
        settings.observe = [this](const BusEvent& event) {
            const auto* line_event = std::get_if<LineEvent>(&event);
            if (line_event != nullptr && !line_event->why.empty()) seen.push_back(line_event->why);
        };
        make_bus();
    }
    void make_bus() {
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        line->reply = kReply;
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings, std::move(memory));
    }
    bool run_until(const std::function<bool()>& so) { return test::run_until(io, clock, so); }
    /// Sends a request and runs the loop until it is answered.
    Answer ask(std::uint8_t station, const Bytes& pdu, ClientId client = 1, bool poll = false) {
        std::optional<Answer> got;
        bus->transact(
            {.station = station, .request = test::request_of(pdu), .client = client, .poll = poll},
            [&](Answer answer) { got = std::move(answer); });
        EXPECT_FALSE(got) << "answered from inside transact()";
        EXPECT_TRUE(run_until([&] { return got.has_value(); })) << "it is never answered";
        return got.value_or(Answer{});
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    test::MemoryLine* line = nullptr;
    std::vector<std::string> seen;  ///< causes and findings of line events
    std::unique_ptr<Bus> bus;
};

TEST_F(BusTest, P2WhatWaitsIsNotWrittenOnceTheStationMayOnlyBeRead) {
    bus->start();
    std::vector<Answer> answers;
    const auto asks = [&](std::uint8_t station, const Bytes& pdu) {
        bus->transact({.station = station, .request = test::request_of(pdu), .client = 1},
                      [&](Answer answer) { answers.push_back(std::move(answer)); });
    };
    for (const int station : {17, 17, 99, 17}) asks(static_cast<std::uint8_t>(station), kWrite);
    asks(17, kRead);
    settings.stations[17].access = Access::read_only;
    bus->apply(settings, nullptr, nullptr);
    ASSERT_TRUE(run_until([&] { return answers.size() == 5; }));
    const Refusal now{Rule::read_only, "press", modbus::ExceptionCode::illegal_function};
    EXPECT_EQ(std::ranges::count(answers, std::optional(now), &Answer::refusal), 3);
    EXPECT_EQ(std::ranges::count(answers, true, &Answer::transmitted), 2)
        << "another's, and a read";
}

TEST_F(BusTest, AGuardedStationIsNotAskedWhatItsProfileRulesOut) {
    bus->start();
    const Answer refused = ask(18, kWrite);
    EXPECT_EQ(refused.pdu.value(), (Bytes{0x86, 2}));
    EXPECT_FALSE(refused.transmitted);
    EXPECT_TRUE(line->written.empty());
    EXPECT_EQ(bus->report().stations.back().requests.at(6)[Outcome::refused], 1u);
    const Refusal guarded{Rule::range, "oven", modbus::ExceptionCode::illegal_data_address,
                          "no memory"};
    EXPECT_EQ(refused.refusal, guarded);
    EXPECT_TRUE(ask(18, kRead).pdu.has_value());
}

TEST_F(BusTest, WhatARightForbidsIsRefusedWhoeverAsks) {
    settings.stations[17].access = Access::read_only;
    make_bus();
    bus->start();
    const Answer write = ask(17, kWrite);
    EXPECT_EQ(write.pdu.error(), Fault::denied);
    EXPECT_FALSE(write.transmitted);
    ASSERT_TRUE(write.refusal);
    EXPECT_EQ(write.refusal->rule, Rule::read_only);
    EXPECT_EQ(write.refusal->station, "press");
    const Answer broadcast = ask(0, kWrite);
    EXPECT_EQ(broadcast.pdu.error(), Fault::denied);
    EXPECT_EQ(broadcast.refusal.value().rule, Rule::broadcast_over_read_only);
    EXPECT_TRUE(line->written.empty());
    EXPECT_EQ(bus->report().stations[1].requests.at(6)[Outcome::refused], 1u);
    EXPECT_TRUE(ask(17, kRead).pdu.has_value());
    EXPECT_FALSE(ask(17, kRead).refusal);
}

TEST_F(BusTest, SaysEarlyWhatItWouldRefuse) {
    EXPECT_EQ(bus->refusal_of_write(17), std::nullopt);
    settings.stations[17].access = Access::read_only;
    make_bus();
    EXPECT_EQ(bus->refusal_of_write(17).value().rule, Rule::read_only);
    EXPECT_EQ(bus->refusal_of_write(18), std::nullopt) << "its guard wants to see the write";
    EXPECT_EQ(bus->refusal_of_write(0).value().station, "press");
    EXPECT_TRUE(bus->idle());
}

TEST_F(BusTest, AsksALineThatCanTellWhetherTheRequestHasLeft) {
    line->tells_unsent = true;
    bus->start();
    const int before = line->asked_for_unsent;
    EXPECT_TRUE(ask(17, kRead).pdu.has_value());
    line->reply.clear();
    EXPECT_FALSE(ask(17, kRead).pdu.has_value());
    EXPECT_GT(line->asked_for_unsent, before);
}

TEST_F(BusTest, SaysOnceWhatIsWrongWithTheLineAndOnceThatItIsNoMore) {
    bus->start();
    EXPECT_TRUE(bus->status().findings.empty());
    line->reply.clear();
    for (int i = 0; i < 5; ++i) ask(17, kRead);  // the first one twice
    ASSERT_EQ(bus->status().findings.size(), 1u);
    const LineFinding finding = bus->status().findings[0];
    EXPECT_EQ(finding.cause, "no-answer-at-all");
    EXPECT_FALSE(finding.station);
    EXPECT_FALSE(finding.text.empty());
    EXPECT_FALSE(finding.advice.empty());
    EXPECT_EQ(finding.evidence, "1 station(s) asked, the last 6 requests without a reply");
    EXPECT_EQ(seen, std::vector<std::string>{"finding: no-answer-at-all, station all"});
    line->reply = kReply;
    EXPECT_TRUE(ask(18, kRead).pdu.has_value());
    const auto now = bus->status().findings;
    ASSERT_EQ(now.size(), 1u) << "one answers: it is not the line";
    EXPECT_EQ(now[0].cause, "station-silent");
    EXPECT_EQ(now[0].station, 17);
    EXPECT_EQ(seen, (std::vector<std::string>{"finding: no-answer-at-all, station all",
                                              "finding gone: no-answer-at-all, station all",
                                              "finding: station-silent, station press"}));
}

TEST_F(BusTest, ALineThatWorksHasNoFinding) {
    bus->start();
    for (int i = 0; i < 50; ++i) ask(17, kRead);
    EXPECT_TRUE(bus->status().findings.empty());
    EXPECT_TRUE(seen.empty());
}

TEST_F(BusTest, SaysWhyInTheTraceAndWhoUsesTheLine) {
    bus->start();
    bus->name_client(1, "modbus_tcp 10.0.0.7:5000");
    ask(17, kRead);
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

TEST_F(BusTest, TellsInTheTraceWhenByTheClockOnTheWall) {
    bus->start();
    const WallTime before = rt::wall_now();
    ask(17, kRead);
    for (const TraceFrame& frame : bus->trace(2).frames) {
        EXPECT_GE(frame.time, before - 1s);
        EXPECT_LE(frame.time, rt::wall_now() + 1s);
    }
}

TEST_F(BusTest, ALineThatIsDownSaysWhy) {
    bus->start();
    line->events()->on_down("Permission denied");
    const Answer answer = ask(17, kRead);
    EXPECT_EQ(answer.pdu.error(), Fault::line_down);
    EXPECT_EQ("down: " + answer.why, bus->status().state);
}

TEST_F(BusTest, CarriesARequestToTheLineAndTheReplyBack) {
    bus->start();
    const Answer answer = ask(17, kRead);
    EXPECT_EQ(answer.pdu.value(), kReply);
    EXPECT_TRUE(answer.transmitted);
    ASSERT_EQ(line->written.size(), 1u);
    EXPECT_EQ(line->written[0], "11 03 00 6B 00 03 76 87"_hex);
    const auto trace = bus->trace(10).frames;
    ASSERT_EQ(trace.size(), 2u);
    EXPECT_EQ(trace[0].kind, FrameKind::request);
    EXPECT_EQ(trace[1].bytes, "11 03 06 02 2B 00 00 00 64 C8 BA"_hex);
    EXPECT_EQ(bus->station_status(17).state, Health::online);
}

TEST_F(BusTest, NumbersFramesAndDecisionsOfALineTogether) {
    bus->start();
    ask(17, kRead);
    std::set<std::uint64_t> numbers;
    for (const TraceFrame& frame : bus->trace(100).frames) numbers.insert(frame.sequence);
    for (const TraceDecision& decision : bus->trace(100).decisions)
        numbers.insert(decision.sequence);
    EXPECT_EQ(numbers.size(), bus->trace(100).frames.size() + bus->trace(100).decisions.size());
    EXPECT_EQ(*numbers.begin(), 1u);
    EXPECT_EQ(*numbers.rbegin(), numbers.size());
    ASSERT_GE(bus->trace(100).frames.size(), 2u);
    const auto later = bus->trace_since(bus->trace(100).frames[0].sequence, 1).frames;
    ASSERT_EQ(later.size(), 1u);
    EXPECT_EQ(later[0].sequence, bus->trace(100).frames[1].sequence);
}

TEST_F(BusTest, AnswersLineDownBeforeTheDeviceIsThere) {
    line->up_at_start = false;
    bus->start();
    const Answer answer = ask(17, kRead);
    EXPECT_EQ(answer.pdu.error(), Fault::line_down);
    EXPECT_FALSE(answer.transmitted);
}

TEST_F(BusTest, GivesPollsReadsAndWritesTheirClass) {
    bus->start();
    ask(17, kRead);
    ask(17, kWrite);
    ask(17, "41 00"_hex);
    ask(17, kRead, 1, true);
    ask(17, kWrite, 1, true);
    std::vector<std::string> classes;
    for (const TraceFrame& frame : bus->trace(100).frames) {
        if (frame.kind == FrameKind::request)
            classes.push_back(frame.why.substr(0, frame.why.find(' ')));
    }
    EXPECT_EQ(classes, (std::vector<std::string>{"read", "write", "write", "poll", "poll"}));
}

TEST_F(BusTest, RefusesWhatMayNotBeTransmitted) {
    bus->start();
    EXPECT_EQ(ask(0, kRead).pdu.error(), Fault::denied);
    EXPECT_EQ(ask(17, "08 00 04 00 00"_hex).pdu.error(), Fault::denied);
    EXPECT_TRUE(line->written.empty());
}

TEST_F(BusTest, ASilentStationIsATimeoutAndSaysSoInTheStatus) {
    line->reply.clear();
    bus->start();
    const Answer answer = ask(17, kWrite);
    EXPECT_EQ(answer.pdu.error(), Fault::timeout);
    EXPECT_TRUE(answer.transmitted);
    EXPECT_EQ(line->written.size(), 1u);
    EXPECT_EQ(bus->station_status(17).state, Health::suspect);
}

TEST_F(BusTest, ABroadcastIsAnsweredWithoutAReply) {
    bus->start();
    const Answer answer = ask(0, kWrite);
    EXPECT_EQ(answer.pdu.value(), kWrite);
    EXPECT_EQ(line->written.size(), 1u);
    EXPECT_EQ(line->written[0][0], 0);
}

TEST_F(BusTest, ALineThatIsLostInsideAWriteAnswersOnceAndDoesNotRecurse) {
    line->fail_writes = true;
    bus->start();
    const Answer answer = ask(17, kWrite);
    EXPECT_EQ(answer.pdu.error(), Fault::line_lost);
    EXPECT_TRUE(answer.transmitted);
    EXPECT_FALSE(bus->status().up);
}

TEST_F(BusTest, AnAnswerMaySubmitTheNextRequest) {
    bus->start();
    int answers = 0;
    std::function<void()> again = [&] {
        bus->transact({.station = 17, .request = test::request_of(kRead)},
                      [&](const Answer& answer) {
                          EXPECT_TRUE(answer.pdu.has_value());
                          if (++answers < 20) again();
                      });
    };
    again();
    EXPECT_TRUE(run_until([&] { return answers == 20; }));
}

/// The reply arrived while the loop was busy, and the timeout expires before it is read.
TEST_F(BusTest, P1AReplyThatLiesInTheDeviceWhenItsTimeIsOverIsNoTimeout) {
    line->reply.clear();
    bus->start();
    std::optional<Answer> got;
    bus->transact({.station = 17, .request = test::request_of(kWrite)},
                  [&](Answer answer) { got = std::move(answer); });
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    clock.advance(1ms);
    line->come(modbus::encode_adu(17, kWrite));
    clock.pass(50ms);
    ASSERT_TRUE(run_until([&] { return got.has_value(); }));
    EXPECT_EQ(got->pdu.value(), kWrite);
    EXPECT_EQ(bus->station_status(17).state, Health::online);
}

/// Bytes before the request delay it by the gap and answer nothing.
TEST_F(BusTest, P1StaleBytesAreReadBeforeARequestIsSent) {
    bus->start();
    clock.advance(1s);
    line->come(modbus::encode_adu(17, "03 06 0B AD 0B AD 0B AD"_hex));
    std::optional<Answer> got;
    const TimePoint asked = clock.now();
    bus->transact({.station = 17, .request = test::request_of(kRead)},
                  [&](Answer answer) { got = std::move(answer); });
    EXPECT_TRUE(line->written.empty()) << "the wire is not quiet yet";
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    EXPECT_GE(clock.now() - asked, silent_interval({1000000, 8, Parity::none, 1}));
    ASSERT_TRUE(run_until([&] { return got.has_value(); }));
    EXPECT_EQ(got->pdu.value(), kReply);
    EXPECT_EQ(bus->trace(1).frames.front().bytes, modbus::encode_adu(17, kReply));
    EXPECT_EQ(direction_of(bus->trace(10).frames.front().kind), FrameDirection::discarded);
}

TEST_F(BusTest, RefusalsAreHandedOutAMillisecondApart) {
    bus->start();
    int refused = 0;
    const auto ask_wrongly = [&] {
        bus->transact({.station = 0, .request = test::request_of(kRead)},
                      [&](const Answer&) { ++refused; });
    };
    ask_wrongly();
    ask_wrongly();
    io.poll();
    EXPECT_EQ(refused, 0);
    clock.advance(1ms);
    EXPECT_EQ(refused, 2);
    ask_wrongly();
    clock.advance(1ms - 1ns);
    EXPECT_EQ(refused, 2);
    clock.advance(1ns);
    EXPECT_EQ(refused, 3);
}

TEST_F(BusTest, StoppingAnswersWhatIsOpen) {
    line->reply.clear();
    bus->start();
    std::vector<Fault> faults;
    for (const char* pdu : {"03 00 00 00 01", "03 00 10 00 01", "03 00 20 00 01"}) {
        bus->transact({.station = 17, .request = test::request_of(from_hex(pdu).value())},
                      [&](const Answer& a) { faults.push_back(a.pdu.error()); });
    }
    ASSERT_TRUE(run_until([&] { return !line->written.empty(); }));
    bus.reset();
    io.restart();
    io.run();
    EXPECT_EQ(faults, (std::vector<Fault>{Fault::line_lost, Fault::line_down, Fault::line_down}));
}

TEST_F(BusTest, P10CountsByConfiguredNamesOnly) {
    bus->start();
    ask(17, kRead);
    ask(99, kRead);
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
