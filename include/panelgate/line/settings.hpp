#pragma once

#include <string>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::line {

struct Settings {
    std::string device;  ///< path of a serial device
    SerialFormat serial;
    Duration reopen_min = 100ms;  ///< back-off between attempts to open, doubled each time
    Duration reopen_max = 1s;
};

}  // namespace panelgate::line
