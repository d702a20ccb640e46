#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter {

using test::BusScript;

inline const Bytes kRead = "03 00 6B 00 03"_hex;
inline const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
inline const Bytes kWrite = "06 00 01 00 03"_hex;

/// A read of three registers that touches no other one with another number.
inline Bytes read_at(unsigned number) { return Writer().u8(3).u16(100 * number).u16(3).take(); }

/// Three registers, other ones each time.
inline Bytes reply_number(std::size_t number) {
    return Writer().u8(3).u8(6).u16(static_cast<unsigned>(number)).u16(2).u16(3).take();
}

inline Settings settings_38400() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.unlisted.response_timeout = 500ms;
    settings.unlisted.retries = 1;
    settings.unlisted.vouched = true;
    settings.stations = {settings.unlisted, settings.unlisted};
    settings.stations[0].id = 17;
    settings.stations[1].id = 18;
    return settings;
}

/// The station answers so long after the request sent last has left.
inline void answer(BusScript& bus, std::uint8_t station, ByteView pdu, Duration after = {}) {
    bus.run_to_end_of_request();
    bus.run_for(after);
    bus.hear_reply(station, pdu);
}

/// The next request is sent, and the station answers it.
inline void answer_next(BusScript& bus, std::uint8_t station, ByteView pdu, Duration after = {}) {
    ASSERT_TRUE(bus.next_sent());
    answer(bus, station, pdu, after);
}

/// It is answered at this instant and not before.
inline void expect_answer_at(BusScript& bus, Ticket ticket, TimePoint at) {
    bus.run_until(at - 1us);
    EXPECT_FALSE(bus.answered(ticket));
    bus.run_until(at);
    EXPECT_TRUE(bus.answered(ticket));
}

/// P1: a late reply of the same shape answers no request and ends the rest.
inline void expect_no_answer_by_a_late_reply(Settings settings) {
    settings.stations[0].retries = 0;
    BusScript bus{settings};
    const Ticket first = bus.submit(17, read_at(1), 1);
    const Ticket second = bus.submit(17, read_at(2), 2);
    while (!bus.answered(first)) bus.run_for(1ms);
    bus.run_for(300ms);
    bus.hear_reply(17, kReply);  // of the first: same station, function and length
    bus.run_for(100ms);
    EXPECT_FALSE(bus.answered(second));
    ASSERT_EQ(bus.events.size(), 1u);
    EXPECT_EQ(bus.events[0].kind, StationEvent::Kind::late);
    ASSERT_EQ(bus.sent.size(), 2u);
    bus.hear_reply(17, reply_number(2));
    EXPECT_EQ(bus.answer(second).pdu.value(), reply_number(2));
}

/// The arbiter of a line with the stations 17 and 18.
class ArbiterTest : public testing::Test {
  protected:
    const StationCounters& counters(std::uint8_t station = 17) {
        return bus.arbiter().station_counters().at(station);
    }

    Settings settings = settings_38400();
    BusScript bus{settings};
    Duration gap = silent_interval(settings.serial);
};

/// Two panels that need 12 ms, heard often enough.
class ArbiterAnswersTest : public ArbiterTest {
  protected:
    void know(std::uint8_t station = 17, Duration after = 12ms) {
        for (unsigned i = 1; i <= RecentTimes::kEnough; ++i) read(station, i, after);
    }
    void read(std::uint8_t station, unsigned number, Duration after = 12ms) {
        script.run_for(10ms);
        script.submit(station, read_at(number), 1);
        answer(script, station, reply_number(number), after);
    }
    Ticket ask(unsigned number) {
        script.run_for(10ms);
        return script.submit(17, read_at(number), 1);
    }
    /// All that comes is an answer before the request has left; asked again it answers in time.
    void ask_behind_an_early(unsigned number, const Bytes& early) {
        const Ticket ticket = ask(number);
        script.hear_reply(17, early);
        EXPECT_FALSE(script.answered(ticket));
        ASSERT_TRUE(script.next_sent(200ms));
        answer(script, 17, reply_number(1000 + number), 12ms);
        EXPECT_EQ(value(ticket), reply_number(1000 + number));
        script.run_for(2s);
    }
    /// Behind the first answer a second one comes, 4 ms later.
    void answer_twice(unsigned first, unsigned second) {
        answer(script, 17, reply_number(first), 12ms);
        script.run_for(4ms);
        script.hear_reply(17, reply_number(second));
    }
    /// Answers that nobody asked for have come behind those that were.
    void knows_surplus() {
        for (const unsigned i : {1u, 20u}) {
            read(17, i);
            script.run_for(4ms);
            script.hear_reply(17, reply_number(500 + i));
            for (unsigned k = 1; k < 10; ++k) read(17, i + k);
        }
    }
    Bytes value(Ticket ticket) {
        const bool good = script.answered(ticket) && script.answer(ticket).pdu.has_value();
        return good ? script.answer(ticket).pdu.value() : Bytes{};
    }

    BusScript script{settings};
};

}  // namespace panelgate::arbiter
