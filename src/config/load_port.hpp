#pragma once

#include "loader.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"

namespace panelgate::config {

/// `device`, `serial` and `rs485` of a serial port that is no line; its mode is known. False when
/// its serial format had a fault: then nothing may be concluded from it.
bool load_port(Loading& loading, yaml::MapReader& in, line::Settings& port, SerialMode mode);

}  // namespace panelgate::config
