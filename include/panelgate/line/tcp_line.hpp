#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// Creates a line over a TCP connection to a serial device server, `settings.device` as above. It
/// reconnects with back-off; a server that acknowledges nothing for 6 s is lost, also while idle.
/// undelivered(): the server's system has not acknowledged written bytes within the time of a
/// delayed acknowledgement. Closing is then a reset (RST), and nothing more is sent. The clock
/// outlives the line.
std::unique_ptr<Line> make_tcp_line(boost::asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings);

}  // namespace panelgate::line
