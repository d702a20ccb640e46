#pragma once

#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"

namespace panelgate::config {

/// Reads `device`, `serial` and `rs485` of a serial port that is not a line; its mode is known.
/// False if its serial format had a fault and must not be used.
bool load_port(Loading& loading, yaml::MapReader& in, line::Settings& port, SerialMode mode);

/// Reads `serial` of a port, or of a line, whose format it is; nullptr: the mode is set elsewhere,
/// and in `format` already. False if there was a fault: the format must not be used.
bool load_serial(Loading& loading, yaml::MapReader& in, SerialFormat& format, Line* line);

}  // namespace panelgate::config
