#pragma once

#include <cstdint>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::tcp_server {

/// What is to be done with a request.
struct Refuse {
    modbus::ExceptionCode code;
    std::vector<Target> asked{};  ///< whose buses count it as refused
};
struct Forward {
    Target target;
    modbus::Request request;
};
struct Broadcast {
    std::vector<bus::BusClient*> lines;
    modbus::Request request;
};
struct Diagnose {};  ///< the gateway answers from its own registers
using Decision = std::variant<Refuse, Forward, Broadcast, Diagnose>;

/// Judges a request in the order of EXC-08: function 0 or 128..255 is 01; a write through a
/// listener where only reads are allowed 01; a unit that nobody has 0A; a write that its bus would
/// refuse 01, before anything else is said of it; anything but a write (BC-02) to a broadcast unit
/// 01; a PDU that contradicts its function or cannot be answered 03. Asks nobody but for their
/// rights.
Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units);

}  // namespace panelgate::tcp_server
