#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"

namespace panelgate::line {

/// RTU frames over a TCP connection to a serial device server, `settings.device` as above. Connects
/// again with back-off, sends keepalives, TCP_NODELAY.
std::unique_ptr<Line> make_tcp_line(boost::asio::any_io_executor executor, Settings settings);

}  // namespace panelgate::line
