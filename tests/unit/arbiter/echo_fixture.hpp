#pragma once

#include <gtest/gtest.h>

#include "panelgate/arbiter/settings.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"

namespace panelgate::arbiter::echo {

using test::BusScript;

inline const Bytes kRead = "03 00 6B 00 03"_hex;
inline const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
inline const Bytes kWriteCoil = "05 00 01 FF 00"_hex;
inline const Bytes kWriteRegister = "06 00 01 00 03"_hex;

class Echo : public testing::Test {
  protected:
    static Settings settings(EchoMode mode) {
        Settings s;
        s.serial = {38400, 8, Parity::none, 1};
        s.unlisted.retries = 0;
        s.stations = {s.unlisted};
        s.stations[0].id = 17;
        s.echo = mode;
        return s;
    }
    /// The adapter hears what was sent last; then the station answers, or not.
    static void hear_echo(BusScript& bus) {
        const Bytes adu = bus.sent.back().adu;
        bus.hear_paced(adu);
    }
    static void reply(BusScript& bus, ByteView pdu) {
        bus.run_for(3ms);
        bus.hear_reply(17, pdu);
    }
    /// A line that has carried a read and is known to have an echo, or not to have one.
    static void read_once(BusScript& bus, bool echo) {
        const Ticket ticket = bus.submit(17, kRead);
        if (echo) hear_echo(bus);
        bus.run_to_end_of_request();
        reply(bus, kReply);
        ASSERT_TRUE(bus.answered(ticket));
        EXPECT_EQ(bus.answer(ticket).pdu.value(), kReply);
        bus.run_for(10ms);
    }
};

}  // namespace panelgate::arbiter::echo
