#pragma once

#include <string>

#include "plant.hpp"

namespace panelgate::app {

/// What `systemctl status` shows: "2 of 3 lines up, listening on modbus_tcp 127.0.0.1:502, http
/// 127.0.0.1:8080". `standing` and `missing` are those of Openings.
std::string service_status(const Plant& plant, const std::string& standing,
                           const std::string& missing);

}  // namespace panelgate::app
