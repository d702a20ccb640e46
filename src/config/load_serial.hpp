#pragma once

#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/ascii_frame.hpp"

namespace panelgate::config {

/// `serial` of a line or a port; `digits` of a line, nothing where the mode stands elsewhere and is
/// in `format` already. False when there was a fault: then nothing may be concluded from it.
bool load_serial(Loading& loading, yaml::MapReader& in, SerialFormat& format,
                 modbus::HexDigits* digits);

}  // namespace panelgate::config
