// Every script again with a fault at each of its steps: whatever goes wrong when, each request gets
// one answer, the line becomes idle, and nothing is sent without a client.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "arbiter_fixture.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/bus_script.hpp"
#include "support/bus_script_replay.hpp"
#include "support/bus_step.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::replay_test {
namespace {

const Bytes kOther = "03 01 00 00 03"_hex;

struct Script {
    const char* name = "";
    std::function<void(BusScript&)> play;
    std::function<void(Settings&)> set = [](Settings&) {};

    friend void PrintTo(const Script& script, std::ostream* out) { *out << script.name; }
};

Settings settings_of(const Script& script) {
    Settings settings = settings_38400();
    settings.unlisted.response_timeout = 200ms;
    for (StationSettings& station : settings.stations) station.response_timeout = 200ms;
    settings.offline.after = 2;
    script.set(settings);
    return settings;
}

/// The station answers the request sent last after 3 ms, in two pieces.
void in_pieces(BusScript& bus, std::uint8_t station, const Bytes& pdu) {
    bus.run_to_end_of_request();
    bus.run_for(3ms);
    const Bytes adu = modbus::encode_adu(station, pdu);
    bus.hear(ByteView(adu).first(3));
    bus.run_for(1ms);
    bus.hear(ByteView(adu).subspan(3));
}
/// The station answers the request sent next in the same way.
void next_in_pieces(BusScript& bus, std::uint8_t station, const Bytes& pdu) {
    bus.next_sent();
    in_pieces(bus, station, pdu);
}

void read_and_write(BusScript& bus) {
    bus.submit(17, kRead, 1);
    bus.submit(17, kWrite, 2, PriorityClass::write);
    bus.submit(18, kRead, 1);
    in_pieces(bus, 17, kReply);
    next_in_pieces(bus, 17, kWrite);
    next_in_pieces(bus, 18, kReply);
}

void shared_reads(BusScript& bus) {
    bus.submit(18, kRead, 9);
    bus.submit(17, "03 00 0A 00 02"_hex, 1);
    bus.submit(17, "03 00 0C 00 01"_hex, 2);
    bus.submit(17, "03 00 0B 00 01"_hex, 3);
    in_pieces(bus, 18, kReply);
    bus.next_sent();
    bus.submit(17, "03 00 0A 00 01"_hex, 4);  // joins while the request leaves
    in_pieces(bus, 17, "03 06 00 01 00 02 00 03"_hex);
}

void refused_join(BusScript& bus) {
    bus.submit(18, kRead, 9);
    bus.submit(17, "03 00 0A 00 02"_hex, 1);
    bus.submit(17, "03 00 0C 00 01"_hex, 2);
    in_pieces(bus, 18, kReply);
    next_in_pieces(bus, 17, "83 02"_hex);
    next_in_pieces(bus, 17, "03 04 00 01 00 02"_hex);
    next_in_pieces(bus, 17, "03 02 00 01"_hex);
}

void retry(BusScript& bus) {
    bus.submit(17, kRead, 1);
    bus.submit(18, kRead, 2);
    next_in_pieces(bus, 17, kReply);
    next_in_pieces(bus, 18, kReply);
}

void late_reply(BusScript& bus) {
    bus.submit(17, kRead, 1);
    bus.submit(17, kOther, 2);
    bus.run_for(250ms);
    bus.hear_reply(17, kReply);
    bus.run_for(100ms);
    bus.hear_reply(17, kReply);
    bus.run_for(500ms);
    bus.hear_reply(17, kReply);
}

void noise(BusScript& bus) {
    bus.submit(17, kRead, 1);
    bus.submit(17, kOther, 2);
    bus.run_to_end_of_request();
    bus.hear("11 03"_hex);
    bus.run_for(30ms);
    bus.hear("00"_hex);
    bus.run_for(30ms);
    in_pieces(bus, 17, kReply);
    bus.run_for(300ms);
    in_pieces(bus, 17, kReply);
}

void write_without_answer(BusScript& bus) {
    bus.submit(17, kWrite, 1, PriorityClass::write);
    bus.submit(17, kRead, 2);
    bus.run_for(300ms);
    bus.hear_reply(17, kWrite);
    bus.run_for(300ms);
    in_pieces(bus, 17, kReply);
}

void broadcast(BusScript& bus) {
    bus.submit(0, kWrite, 1, PriorityClass::write);
    bus.submit(17, kRead, 2);
    bus.run_for(50ms);
    bus.hear_reply(17, kWrite);
    bus.run_for(100ms);
    in_pieces(bus, 17, kReply);
}

void learned_echo(BusScript& bus) {
    bus.submit(17, kWrite, 1, PriorityClass::write);
    bus.run_to_end_of_request();
    bus.hear(bus.sent.back().adu);
    in_pieces(bus, 17, kReply);
    bus.next_sent();
    bus.run_to_end_of_request();
    bus.hear(bus.sent.back().adu);
    in_pieces(bus, 17, kWrite);
}

void offline_and_back(BusScript& bus) {
    for (Client client = 1; client <= 3; ++client) bus.submit(17, kRead, client);
    bus.run_for(1500ms);
    bus.try_submit(17, kOther, 4);
    bus.try_submit(17, kWrite, 5, PriorityClass::write);
    bus.submit(18, kRead, 1);
    bus.run_for(3s);
    bus.hear_reply(17, kReply);
    bus.run_for(1s);
    bus.try_submit(17, kRead, 2);
    bus.run_for(10ms);
    bus.hear_reply(17, kReply);
}

void memory(BusScript& bus) {
    bus.submit(17, kRead, 1);
    in_pieces(bus, 17, kReply);
    bus.run_for(100ms);
    bus.submit(17, kRead, 2);
    bus.submit(17, "06 00 6B 00 01"_hex, 1, PriorityClass::write);
    bus.submit(17, kRead, 2);
    in_pieces(bus, 17, "06 00 6B 00 01"_hex);
    next_in_pieces(bus, 17, kReply);
}

void each_station(Settings& settings, const std::function<void(StationSettings&)>& change) {
    for (StationSettings& station : settings.stations) change(station);
}

const Script kScripts[] = {
    {"ReadAndWrite", read_and_write},
    {"SharedReads", shared_reads},
    {"RefusedJoin", refused_join},
    {"Retry", retry},
    {"RetryWhileOthersGoOn", retry, [](Settings& s) { s.quarantine = Quarantine::station; }},
    {"LateReply", late_reply},
    {"LateReplyOnALineThatRests", late_reply, [](Settings& s) { s.quarantine = Quarantine::line; }},
    {"LateReplyOnALineThatStalls", late_reply, [](Settings& s) { s.may_stall = true; }},
    {"Noise", noise},
    {"WriteWithoutAnswer", write_without_answer},
    {"WriteThatIsRepeated", write_without_answer,
     [](Settings& s) { each_station(s, [](auto& station) { station.retry_writes = true; }); }},
    {"Broadcast", broadcast},
    {"LearnedEcho", learned_echo, [](Settings& s) { s.echo = EchoMode::automatic; }},
    {"OfflineAndBack", offline_and_back},
    {"Memory", memory,
     [](Settings& s) { each_station(s, [](auto& station) { station.max_age = 1s; }); }},
};

class Replay : public testing::TestWithParam<Script> {};

TEST_P(Replay, EndsWellWithAFaultAtAnyStep) {
    const Settings settings = settings_of(GetParam());
    BusScript bus(settings);
    GetParam().play(bus);
    const std::vector<test::BusStep> steps = bus.steps;
    test::expect_rest(bus);
    ASSERT_FALSE(HasFailure()) << "without any fault";
    test::replay_with_faults(settings, steps);
}

INSTANTIATE_TEST_SUITE_P(Every, Replay, testing::ValuesIn(kScripts),
                         [](const auto& info) { return std::string(info.param.name); });

/// The recorded steps equal the executed ones.
TEST(BusScript, PlaysWhatItRecorded) {
    for (const Script& script : kScripts) {
        BusScript bus(settings_of(script));
        script.play(bus);
        BusScript again(settings_of(script));
        for (const test::BusStep& step : bus.steps) again.play(step);
        ASSERT_EQ(again.sent.size(), bus.sent.size()) << script.name;
        for (std::size_t i = 0; i < bus.sent.size(); ++i) {
            EXPECT_EQ(again.sent[i].at, bus.sent[i].at) << script.name;
            EXPECT_EQ(again.sent[i].adu, bus.sent[i].adu) << script.name;
        }
        EXPECT_EQ(again.answers.size(), bus.answers.size()) << script.name;
    }
}

}  // namespace
}  // namespace panelgate::arbiter::replay_test
