#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// RTU frames over a TCP connection to a serial device server, `settings.device` as above. Connects
/// again with back-off; a server that acknowledges nothing for 6 s is gone, also while nobody asks.
/// undelivered(): the server's system has not acknowledged what was written, beyond what a delayed
/// acknowledgement takes. Closing then is a reset (RST), and nothing is sent any more. The clock
/// outlives the line.
std::unique_ptr<Line> make_tcp_line(boost::asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings);

}  // namespace panelgate::line
