#pragma once

#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>

#include "commands.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/endpoint.hpp"

namespace panelgate::app {

/// What stands behind `listen:` of the top-level `http:` in a text that is no YAML, as somebody is
/// about to change it; "" where none is found, or more than one. By its lines: braces over several
/// lines, anchors and the like are not understood. Pure.
std::string http_listen_in(std::string_view text);

/// Why nobody can know where a gateway listens.
struct NoDoor {
    std::string why;
    ExitCode code;  ///< kUsage: of the command line; kNoInput, kBadConfig, kNotReady
};
/// Where the gateway's HTTP listens, its address one that can be connected to: `http` (ADDR:PORT),
/// or, when that is "", what the file says, faults or not. Without the usual file the default: what
/// runs without one listens there.
std::variant<config::Endpoint, NoDoor> http_door(const std::string& file, const std::string& http);

/// What came of a question to a gateway that runs: as it came, HTTP with its head.
struct Said {
    std::string text;
    boost::system::error_code error;  ///< why nothing more came; nothing, too, when time was over

    bool is_http() const { return text.starts_with("HTTP/1."); }
    /// "200 OK" of the status line (RFC 9112, 4); fit for a terminal.
    std::string status() const;
    /// What stands behind the head; nothing before that is whole.
    std::string_view body() const;
    /// Why nothing at all came, in words.
    std::string silence() const;
};
/// The first line of `text`, fit for a terminal.
std::string first_line(std::string_view text);

/// Sends a request over a connection of its own and listens until `enough`, `most` bytes, the end
/// of the connection, or for `patience`. `address`: an IP address, without brackets.
Said ask(const std::string& address, std::uint16_t port, const std::string& request,
         Duration patience, std::size_t most, const std::function<bool(const Said&)>& enough);

/// Asks http://ADDR:PORT/readyz and waits for at most `patience`. Empty when the answer is 200;
/// else what came instead, in one line of printable words. `address`: an IP address, without
/// brackets.
std::string ask_whether_ready(const std::string& address, std::uint16_t port, Duration patience);

}  // namespace panelgate::app
