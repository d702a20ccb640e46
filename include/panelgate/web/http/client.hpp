#pragma once

#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/tls/stream.hpp"

namespace panelgate::web {

/// Where a request is sent, and by whose certificate the server is known.
struct HttpTarget {
    std::string host;  ///< an address or a name
    std::uint16_t port = 80;
    std::optional<tls::Trust> trust{};  ///< nothing: plain HTTP
};

/// A server's reply to an HTTP request: the raw text including its head.
struct HttpReply {
    std::string text;
    boost::system::error_code error;  ///< why reading ended; no error also after a timeout
    std::string refused{};            ///< why there is no TLS, in words
    bool secure = false;              ///< the handshake of TLS was done

    bool is_http() const { return text.starts_with("HTTP/1."); }
    /// "200 OK" of the status line (RFC 9112, 4); safe for a terminal.
    std::string status() const;
    /// The body; empty before the head is complete.
    std::string_view body() const;
    /// Why there was no reply at all, in words.
    std::string failure() const;
};
/// The first line of `text`, safe for a terminal.
std::string first_line(std::string_view text);

/// Sends a request over a new connection and reads until `enough`, `most` bytes, the end of the
/// connection, or `patience` is over. Blocks: for a command, or a worker's thread.
HttpReply ask(const HttpTarget& target, const std::string& request, Duration patience,
              std::size_t most, const std::function<bool(const HttpReply&)>& enough);

}  // namespace panelgate::web
