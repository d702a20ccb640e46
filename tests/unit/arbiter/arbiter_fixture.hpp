#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter {

using test::BusScript;

inline const Bytes kRead = "03 00 6B 00 03"_hex;
inline const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
inline const Bytes kWrite = "06 00 01 00 03"_hex;
/// A broadcast, the same write to one station with other values, and the confirmation of either.
inline const Bytes kToAll = "10 00 64 00 02 04 00 0A 01 02"_hex;
inline const Bytes kToOne = "10 00 64 00 02 04 00 0B 00 00"_hex;
inline const Bytes kConfirmed = "10 00 64 00 02"_hex;
/// From the end of a request to the end of the wait for its reply.
inline constexpr Duration kSilence = 500ms + timing::kListensAgain;

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

}  // namespace panelgate::arbiter
