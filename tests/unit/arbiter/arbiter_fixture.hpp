#pragma once

#include <gtest/gtest.h>

#include <cstddef>

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

/// The arbiter of a line with the stations 17 and 18.
class ArbiterTest : public testing::Test {
  protected:
    Settings settings = settings_38400();
    BusScript bus{settings};
    Duration gap = silent_interval(settings.serial);
};

}  // namespace panelgate::arbiter
