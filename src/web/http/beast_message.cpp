#include "beast_message.hpp"

#include <boost/beast/core/string.hpp>
#include <boost/beast/http/error.hpp>
#include <string_view>
#include <utility>

#include "origin.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::web {

namespace {

std::optional<std::string> decode(std::string_view text, bool plus_is_blank) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            out += plus_is_blank && text[i] == '+' ? ' ' : text[i];
            continue;
        }
        const auto byte = from_hex(text.substr(i + 1, 2));
        if (!byte || byte->size() != 1) return std::nullopt;
        out += static_cast<char>(byte->front());
        i += 2;
    }
    if (!is_utf8(out)) return std::nullopt;
    return out;
}

/// Removes and returns the part before the separator; the rest (without it) stays in `text`.
std::string_view next_part(std::string_view& text, char separator) {
    const auto at = text.find(separator);
    const std::string_view part = text.substr(0, at);
    text = at == text.npos ? std::string_view() : text.substr(at + 1);
    return part;
}

/// Removes "http://host:port" and returns the authority (schemes are case-insensitive, RFC 3986
/// 3.1); nullopt if there is none.
std::optional<std::string> take_authority(std::string_view& target) {
    for (const std::string_view scheme : {"http://", "https://"}) {
        if (to_lower(target.substr(0, scheme.size())) != scheme) continue;
        target.remove_prefix(scheme.size());
        const std::string authority(target.substr(0, target.find_first_of("/?#")));
        target.remove_prefix(authority.size());
        return authority;
    }
    return std::nullopt;
}

}  // namespace

std::optional<RequestTarget> parse_target(std::string_view target) {
    RequestTarget parsed;
    parsed.authority = take_authority(target);
    if (!parsed.authority && !target.starts_with('/')) return std::nullopt;
    target = next_part(target, '#');
    std::string_view path = next_part(target, '?');
    parsed.folder = path.ends_with('/');
    if (!path.empty()) path.remove_prefix(1);
    while (!path.empty()) {
        auto segment = decode(next_part(path, '/'), false);
        if (!segment) return std::nullopt;
        parsed.path.push_back(std::move(*segment));
    }
    while (!target.empty()) {
        std::string_view pair = next_part(target, '&');
        if (pair.empty()) continue;
        const auto name = decode(next_part(pair, '='), true);
        auto value = decode(pair, true);
        if (!name || !value) return std::nullopt;
        parsed.query.emplace(*name, std::move(*value));
    }
    return parsed;
}

namespace http = boost::beast::http;
namespace {

/// Returns the authority of an absolute target, otherwise the Host.
std::string authority_of(const BeastRequest& message, const RequestTarget& target) {
    return target.authority ? *target.authority : std::string(message[http::field::host]);
}

}  // namespace

std::optional<RequestTarget> target_of(const BeastRequest& message) {
    const bool of_server = message.method() == http::verb::options && message.target() == "*";
    return parse_target(of_server ? std::string("/*") : std::string(message.target()));
}

bool has_sound_framing(const BeastRequest& message) {
    const std::size_t codings = message.count(http::field::transfer_encoding);
    if (codings == 0) return true;
    return codings == 1 && message.version() >= 11 &&
           boost::beast::iequals(message[http::field::transfer_encoding], "chunked");
}

std::optional<Problem> repeated_field(const BeastRequest& message) {
    for (const char* name : kHeadersRead) {
        if (message.count(name) < 2) continue;
        return problem(400, "a request has one " + std::string(name) + ", not " +
                                std::to_string(message.count(name)));
    }
    return std::nullopt;
}

Parsed<std::string> host_of(const BeastRequest& message, const RequestTarget& target) {
    const std::size_t named = message.count(http::field::host);
    if (named > 1) return problem(400, "a request has one Host, not " + std::to_string(named));
    if (named == 0 && message.version() >= 11) {
        return problem(400, "a request of HTTP/1.1 must have a Host");
    }
    if (named == 0 && !target.authority) return std::string();
    auto host = host_of_authority(authority_of(message, target));
    if (!host) return problem(400, "the Host must be a name or an address, with a port or without");
    return *host;
}

HttpRequest to_request(BeastRequest&& message, RequestTarget target, std::string host) {
    HttpRequest request;
    request.host = std::move(host);
    request.port = port_of_authority(authority_of(message, target));
    request.method = message.method_string();
    request.path = std::move(target.path);
    request.folder = target.folder;
    request.query = std::move(target.query);
    for (const char* name : kHeadersRead) {
        const auto field = message.find(name);
        if (field != message.end()) request.headers[name] = field->value();
    }
    for (const char* name : kListsRead) {
        const auto [first, end] = message.equal_range(name);
        for (auto field = first; field != end; ++field) {
            std::string& all = request.headers[name];
            all += (all.empty() ? "" : ", ") + std::string(field->value());
        }
    }
    request.body = std::move(message.body());
    return request;
}

bool is_parse_error(boost::system::error_code why) {
    return why.category() == http::make_error_code(http::error::bad_method).category() &&
           why != http::error::end_of_stream;
}

Problem problem_of_parse(boost::system::error_code why, std::size_t max_body) {
    if (why == http::error::body_limit) {
        return problem(413, "a body has at most " + std::to_string(max_body) + " bytes");
    }
    if (why == http::error::header_limit || why == http::error::buffer_overflow) {
        return problem(431, "a header has at most " + std::to_string(kHeaderLimit) + " bytes");
    }
    if (why == http::error::partial_message) {
        return problem(400, "the request ends before it is whole; a blank line ends its header");
    }
    return problem(400, "this is not an HTTP/1.1 request: " + why.message());
}

}  // namespace panelgate::web
