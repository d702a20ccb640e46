#include "panelgate/arbiter/settings.hpp"

#include <algorithm>

#include "rules.hpp"

namespace panelgate::arbiter {

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
