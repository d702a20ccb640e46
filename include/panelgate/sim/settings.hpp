#pragma once

#include <cstdint>
#include <map>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::sim {

/// Faults of one simulated panel. Shares are of its replies, 0 (never) to 1 (always).
struct Misbehaviour {
    bool dead = false;   ///< neither executes nor replies
    Duration slow{};     ///< more think time, always
    Duration late_by{};  ///< more think time, for the share `late`
    double late = 0;
    double drop = 0;        ///< executes and does not reply
    double damage = 0;      ///< one bit of the reply is wrong
    double truncate = 0;    ///< half of the reply
    double foreign_id = 0;  ///< the reply carries another address
    double duplicate = 0;   ///< a second panel with this address answers too, a little later
    friend bool operator==(const Misbehaviour&, const Misbehaviour&) = default;
};

struct Settings {
    SerialFormat serial;
    Duration think_time = 1ms;     ///< of a panel, after the silence that ends the request
    modbus::CrcOrders crc_orders;  ///< by station
    bool echo = false;             ///< the adapter echoes what the gateway sends
    std::map<std::uint8_t, Misbehaviour> faults;  ///< by station
    std::uint32_t seed = 1;                       ///< of the random faults
};

}  // namespace panelgate::sim
