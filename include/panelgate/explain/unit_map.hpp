#pragma once

#include <cstdint>

#include "panelgate/config/config.hpp"
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::explain {

/// What becomes of stations that are not listed. On a serial master's line others may answer: it is
/// answered for listed stations only.
enum class Unlisted : std::uint8_t { as_the_line, refused };

/// A configured line as routing sees it, without its bus.
tcp_server::LineInfo line_info(const config::Line& line, Unlisted unlisted);

/// An image as routing sees it, without its bus.
tcp_server::LineInfo image_info(const images::Settings& image, const config::Config& config);

/// Where the units of a listener, or of a serial master, lead in a configuration that need not run.
/// `listener`: its own.
tcp_server::UnitMap unit_map(const tcp_server::Settings& listener, const config::Config& config,
                             Unlisted unlisted);

}  // namespace panelgate::explain
