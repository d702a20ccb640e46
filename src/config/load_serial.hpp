#pragma once

#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/modbus/ascii.hpp"

namespace panelgate::config {

/// `device`, `serial` and `rs485` of a serial port that is no line; its mode is known. False when
/// its serial format had a fault: then nothing may be concluded from it.
bool load_port(Loading& loading, yaml::MapReader& in, line::Settings& port, SerialMode mode);

/// `serial` of a line or a port; `digits` of a line, nothing where the mode stands elsewhere and is
/// in `format` already. False when there was a fault: then nothing may be concluded from it.
bool load_serial(Loading& loading, yaml::MapReader& in, SerialFormat& format,
                 modbus::HexDigits* digits);

}  // namespace panelgate::config
