#pragma once

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// A request target in its origin form, "/a/b%20c?x=1", or its absolute form, "http://host/a" (RFC
/// 9112 3.2).
struct RequestTarget {
    std::vector<std::string> path;
    std::multimap<std::string, std::string> query;  ///< decoded, repeated names kept
    std::optional<std::string> authority;           ///< of an absolute target: "host:80"
    bool folder = false;                            ///< the path ends with '/'
};
/// Parses a target; nullopt for another form, a broken percent-encoding, or invalid UTF-8.
std::optional<RequestTarget> parse_target(std::string_view target);

// Conversion between Beast's messages and ours.

using BeastRequest = boost::beast::http::request<boost::beast::http::string_body>;

constexpr std::uint32_t kHeaderLimit = 16 * 1024;

/// Parses the target; "*" (OPTIONS) becomes a path. nullopt if malformed.
std::optional<RequestTarget> target_of(const BeastRequest& message);
/// True if the end of the body is well defined. Only `chunked` is supported (RFC 9112 6.1, 6.3):
/// bytes after anything else could be taken for a request.
bool has_sound_framing(const BeastRequest& message);
/// Returns 400 if a header that is read occurs twice and would be ambiguous.
std::optional<Problem> repeated_field(const BeastRequest& message);
/// Returns the requested host (RFC 9112 3.2); "" for HTTP/1.0 without one.
Parsed<std::string> host_of(const BeastRequest& message, const RequestTarget& target);
HttpRequest to_request(BeastRequest&& message, RequestTarget target, std::string host);

/// For a year browsers ask this host by HTTPS only (RFC 6797); its other ports and hosts below are
/// not meant.
constexpr const char* kStrictTransport = "max-age=31536000";

template <class Message>
void set_head(Message& message, const HttpResponse& response, bool keep_alive,
              const std::string& product, bool secure) {
    using boost::beast::http::field;
    message.version(11);
    message.result(response.status);
    message.set(field::server, product);
    message.set(field::cache_control, "no-store");
    message.set("X-Content-Type-Options", "nosniff");
    if (secure) message.set("Strict-Transport-Security", kStrictTransport);
    for (const auto& [name, value] : response.headers) message.set(name, value);
    if (response.status != 204 && response.status != 304) {  // no body: RFC 9110 8.6, 15.4.5
        message.set(field::content_type, response.content_type);
        message.content_length(response.shared_body ? response.shared_body->size()
                                                    : response.body.size());
    }
    message.keep_alive(keep_alive);
}

/// True for a malformed request, as opposed to a connection closed between requests.
bool is_parse_error(boost::system::error_code why);
Problem problem_of_parse(boost::system::error_code why, std::size_t max_body);

}  // namespace panelgate::web
