#pragma once

#include <cstdint>
#include <string>

namespace panelgate::bus {

class BusClient;

/// Who a station is: what it is called, and where it is asked.
struct StationRef {
    std::string name;  ///< unique; "LINE:ID" for a station that the configuration does not list
    std::string line;
    std::uint8_t id = 0;
    BusClient* bus = nullptr;  ///< never null; outlives whoever refers to the station
};

}  // namespace panelgate::bus
