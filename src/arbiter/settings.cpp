#include "panelgate/arbiter/settings.hpp"

#include <algorithm>

#include "panelgate/arbiter/queue/job.hpp"

namespace panelgate::arbiter {

bool is_same_wire(const Settings& one, const Settings& other) {
    const bool ascii = one.serial.mode == SerialMode::ascii;
    return one.serial == other.serial && one.ascii_digits == other.ascii_digits &&
           one.echo == other.echo && one.paced == other.paced && one.may_stall == other.may_stall &&
           crc_orders(one) == crc_orders(other) && (!ascii || one.reply_hole == other.reply_hole);
}

modbus::CrcOrders crc_orders(const Settings& settings) {
    using modbus::CrcOrder;
    modbus::CrcOrders orders;
    if (settings.serial.mode == SerialMode::ascii) return orders;
    for (const StationSettings& station : settings.stations)
        orders.set(station.id, station.crc_order);
    const bool all_old = !settings.stations.empty() &&
                         std::ranges::all_of(settings.stations, [](const StationSettings& station) {
                             return station.crc_order == CrcOrder::high_first;
                         });
    orders.set(kBroadcast, all_old ? CrcOrder::high_first : CrcOrder::low_first);
    return orders;
}

}  // namespace panelgate::arbiter
