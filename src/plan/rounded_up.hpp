#pragma once

#include "panelgate/base/time.hpp"

namespace panelgate::plan {

/// To whole milliseconds of up to two digits, which people would choose.
inline Duration rounded_up(Duration duration) {
    Duration unit = 1ms;
    while (duration > 20 * unit) unit *= 10;
    return (duration + unit - Duration(1)) / unit * unit;
}

}  // namespace panelgate::plan
