#pragma once

#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/modbus/ascii.hpp"

namespace panelgate::config {

/// Reads `device`, `serial` and `rs485` of a serial port that is not a line; its mode is known.
/// False if its serial format had a fault and must not be used.
bool load_port(Loading& loading, yaml::MapReader& in, line::Settings& port, SerialMode mode);

/// Reads `serial` of a line or a port; `digits` is for a line, nullptr if the mode is set elsewhere
/// and in `format` already. False if there was a fault: the format must not be used.
bool load_serial(Loading& loading, yaml::MapReader& in, SerialFormat& format,
                 modbus::HexDigits* digits);

}  // namespace panelgate::config
