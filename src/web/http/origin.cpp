#include "origin.hpp"

#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/system/error_code.hpp>
#include <cctype>
#include <cstddef>

#include "panelgate/base/text.hpp"

namespace panelgate::web {

namespace {

namespace ip = boost::asio::ip;

/// Unmaps IPv4-mapped IPv6 and removes the zone, which hosts are written without.
ip::address plain(const ip::address& address) {
    if (address.is_v4()) return address;
    const ip::address_v6 v6 = address.to_v6();
    if (v6.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, v6);
    return ip::address_v6(v6.to_bytes());
}

bool is_port(std::string_view text) {
    return text.size() <= 5 &&
           std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_address_v6(const std::string& text) {
    boost::system::error_code error;
    ip::make_address_v6(text, error);
    return !error;
}

/// An address cannot be rebound: who is asked by one is who has it (a container is asked by that of
/// its machine, which is none of its own).
bool is_address(const std::string& host) {
    boost::system::error_code error;
    ip::make_address(host, error);
    return !error;
}

/// Accepts the characters of names in practice; RFC 3986 allows more.
bool is_name(std::string_view text) {
    return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
        return (std::isalnum(c) != 0 && c < 0x80) || c == '-' || c == '.' || c == '_';
    });
}

}  // namespace

std::optional<std::string> host_of_authority(std::string_view authority) {
    const bool bracketed = authority.starts_with('[');
    const std::size_t end = bracketed ? authority.find(']') : authority.find(':');
    if (bracketed && end == authority.npos) return std::nullopt;
    std::string host = to_lower(authority.substr(0, end));
    std::string_view rest = end == authority.npos ? std::string_view() : authority.substr(end);
    if (bracketed) {
        host.erase(0, 1);
        rest.remove_prefix(1);
        if (!is_address_v6(host)) return std::nullopt;
    } else {
        if (host.ends_with('.')) host.pop_back();
        if (!is_name(host)) return std::nullopt;
    }
    if (!rest.empty() && (!rest.starts_with(':') || !is_port(rest.substr(1)))) return std::nullopt;
    return host;
}

std::string port_of_authority(std::string_view authority) {
    const std::size_t host = authority.starts_with('[') ? authority.find(']') : 0;
    const std::size_t colon = authority.find(':', host);
    return colon == authority.npos ? std::string() : std::string(authority.substr(colon + 1));
}

std::vector<std::string> machine_names() {
    std::array<char, 256> buffer{};
    if (::gethostname(buffer.data(), buffer.size() - 1) != 0) return {};
    const std::string name(buffer.data());
    if (name.empty()) return {};
    const std::string first = name.substr(0, name.find('.'));
    return {name, first, first + ".local"};
}

HostNames::HostNames(const Settings& settings, const std::vector<std::string>& machine) {
    names_.insert("localhost");
    for (const std::string& host : settings.hosts) configured_.insert(to_lower(host));
    const auto add = [this](const std::string& host) {
        boost::system::error_code error;
        const ip::address address = ip::make_address(host, error);
        if (error) {
            names_.insert(to_lower(host));
        } else {
            addresses_.insert(plain(address));
        }
    };
    add(settings.address);
    for (const std::string& host : settings.hosts.empty() ? machine : settings.hosts) add(host);
}

bool HostNames::knows(const std::string& host, const ip::address& local) const {
    if (names_.contains(host)) return true;
    boost::system::error_code error;
    const ip::address address = plain(ip::make_address(host, error));
    if (error) return false;
    return address.is_loopback() || address == plain(local) || addresses_.contains(address);
}

namespace {

/// True for a page; API and metrics are for programs, and each call may use a line.
bool is_page(const HttpRequest& request) {
    return request.path.empty() || (request.path[0] != "api" && request.path[0] != "metrics");
}

/// A user followed a link. Fetch Metadata: https://www.w3.org/TR/fetch-metadata/
bool follows_link(const HttpRequest& request) {
    return (request.method == "GET" || request.method == "HEAD") &&
           to_lower(header(request, "sec-fetch-mode")) == "navigate" &&
           to_lower(header(request, "sec-fetch-dest")) == "document" && is_page(request);
}

/// True for an origin of ours, such as "http://gateway:8080"; "null" is not. Another port is
/// another site, possibly another user's on this machine, except for configured names, where a
/// proxy may use it.
bool is_ours(std::string_view origin, const HttpRequest& request, const HostNames& names,
             const boost::asio::ip::address& local) {
    const std::size_t scheme = origin.find("://");
    if (scheme == std::string_view::npos) return false;
    const std::string_view authority = origin.substr(scheme + 3);
    const auto host = host_of_authority(authority);
    const bool is_asked = host == request.host && is_address(request.host);
    if (!host || (!is_asked && !names.knows(*host, local))) return false;
    return names.is_configured(*host) || request.host.empty() ||
           port_of_authority(authority) == request.port;
}

}  // namespace

std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local,
                                    const std::vector<std::string>& readers) {
    const std::string& asked = request.host;
    if (!asked.empty() && !is_address(asked) && !names.knows(asked, local)) {
        return problem(421, "this gateway is not called '" + request.host +
                                "'; if it shall be, name it in http: hosts");
    }
    const bool may_read = !listed_origin(request, readers).empty();
    if (may_read && is_reading(request)) return std::nullopt;
    if (to_lower(header(request, "sec-fetch-site")) == "cross-site" && !follows_link(request)) {
        return problem(403, "a page of another site may not ask this gateway", "foreign-page");
    }
    // Browsers send Origin with a change, or a read of the answer by script, even where they send
    // no Fetch Metadata (plain HTTP). A read uses the line too.
    const bool is_foreign = request.method != "OPTIONS" && request.headers.contains("origin") &&
                            !is_ours(to_lower(header(request, "origin")), request, names, local);
    if (is_foreign && may_read)
        return problem(403, "a page of another site may only read (GET) what this gateway has",
                       "foreign-page");
    if (is_foreign)
        return problem(403,
                       "a page of another site may not ask this gateway; if it is one of yours, "
                       "name its host in http: hosts, and if it shall read, its origin in "
                       "http: cors",
                       "foreign-page");
    return std::nullopt;
}

std::string listed_origin(const HttpRequest& request, const std::vector<std::string>& origins) {
    const auto found = request.headers.find("origin");
    if (found == request.headers.end()) return {};
    return is_listed(found->second, origins) ? found->second : std::string();
}

bool is_listed(const std::string& origin, const std::vector<std::string>& origins) {
    return std::ranges::find(origins, to_lower(origin)) != origins.end();
}

bool is_reading(const HttpRequest& request) {
    return request.method == "GET" || request.method == "HEAD" || request.method == "OPTIONS";
}

void share_with(const std::string& origin, bool preflight, HttpResponse& response) {
    add_vary(response, "Origin");
    auto& headers = response.headers;
    headers.emplace_back("Access-Control-Allow-Origin", origin);
    if (!preflight) {
        headers.emplace_back("Access-Control-Expose-Headers", "ETag, Retry-After");
        return;
    }
    headers.emplace_back("Access-Control-Allow-Methods", "GET, HEAD");
    headers.emplace_back("Access-Control-Allow-Headers",
                         "Authorization, If-None-Match, Last-Event-ID");
    headers.emplace_back("Access-Control-Max-Age", "600");  // seconds
}

}  // namespace panelgate::web
