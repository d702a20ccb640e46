#pragma once

#include <cstdint>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::app {

/// Asks http://ADDR:PORT/readyz and waits for at most `patience`. Empty when the answer is 200;
/// else what came instead, in one line of printable words. `address`: an IP address, without
/// brackets.
std::string ask_whether_ready(const std::string& address, std::uint16_t port, Duration patience);

}  // namespace panelgate::app
