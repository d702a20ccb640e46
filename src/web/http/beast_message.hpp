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
struct Target {
    std::vector<std::string> path;
    std::multimap<std::string, std::string> query;  ///< decoded, repetitions included
    std::optional<std::string> authority;           ///< of an absolute one: "host:80"
};
/// Nothing when it has another form, a broken percent-encoding, or decodes to what is not UTF-8.
std::optional<Target> parse_target(std::string_view target);

// Between Beast's messages and ours.

using BeastRequest = boost::beast::http::request<boost::beast::http::string_body>;

constexpr std::uint32_t kHeaderLimit = 16 * 1024;

/// The target, "*" of OPTIONS as a path. Nothing when it cannot be understood.
std::optional<Target> target_of(const BeastRequest& message);
/// Is it clear where the body ends? Only `chunked` is understood (RFC 9112 6.1, 6.3): what follows
/// anything else could be taken for a request.
bool has_sound_framing(const BeastRequest& message);
/// 400 when a header that is looked at comes twice: which of them counts?
std::optional<Problem> repeated_field(const BeastRequest& message);
/// The host that is asked (RFC 9112 3.2); "" of HTTP/1.0 without one.
Parsed<std::string> host_of(const BeastRequest& message, const Target& target);
HttpRequest to_request(BeastRequest&& message, Target target, std::string host);

template <class Message>
void set_head(Message& message, const HttpResponse& response, bool keep_alive,
              const std::string& product) {
    using boost::beast::http::field;
    message.version(11);
    message.result(response.status);
    message.set(field::server, product);
    message.set(field::cache_control, "no-store");
    message.set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : response.headers) message.set(name, value);
    if (response.status != 204 && response.status != 304) {  // no body: RFC 9110 8.6, 15.4.5
        message.set(field::content_type, response.content_type);
        message.content_length(response.shared_body ? response.shared_body->size()
                                                    : response.body.size());
    }
    message.keep_alive(keep_alive);
}

/// Is it the client's fault, and not the end of its connection between two requests?
bool is_parse_error(boost::system::error_code why);
Problem problem_of_parse(boost::system::error_code why, std::size_t max_body);

}  // namespace panelgate::web
