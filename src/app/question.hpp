#pragma once

#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::app {

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

}  // namespace panelgate::app
