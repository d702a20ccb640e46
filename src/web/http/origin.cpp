#include "origin.hpp"

#include <string>
#include <string_view>

#include "to_lower.hpp"

namespace panelgate::web {
namespace {

std::string header(const HttpRequest& request, const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : to_lower(found->second);
}

/// A page is shown; the interface is for programs, and each call of it may cost time on a line.
bool is_page(const HttpRequest& request) {
    return request.path.empty() || (request.path[0] != "api" && request.path[0] != "metrics");
}

/// Fetch Metadata: https://www.w3.org/TR/fetch-metadata/
bool follows_link(const HttpRequest& request) {
    return (request.method == "GET" || request.method == "HEAD") &&
           header(request, "sec-fetch-mode") == "navigate" &&
           header(request, "sec-fetch-dest") == "document" && is_page(request);
}

/// "http://gateway:8080"; "null" is nobody's. Another port is another site, which may be anybody's
/// on this machine; but for names that the configuration has, by which a proxy is called.
bool is_ours(std::string_view origin, const HttpRequest& request, const HostNames& names,
             const boost::asio::ip::address& local) {
    const std::size_t scheme = origin.find("://");
    if (scheme == std::string_view::npos) return false;
    const std::string_view authority = origin.substr(scheme + 3);
    const auto host = host_of_authority(authority);
    if (!host || !names.knows(*host, local)) return false;
    return names.is_configured(*host) || request.host.empty() ||
           port_of_authority(authority) == request.port;
}

}  // namespace

std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local) {
    if (!request.host.empty() && !names.knows(request.host, local)) {
        return problem(421, "this gateway is not called '" + request.host +
                                "'; if it shall be, name it in http: hosts");
    }
    if (header(request, "sec-fetch-site") == "cross-site" && !follows_link(request)) {
        return problem(403, "a page of another site may not ask this gateway", "foreign-page");
    }
    // Browsers name the site of whoever changes something, or wants to read the answer, also where
    // they tell nothing else (plain HTTP). A read costs time on a line, too.
    if (request.method != "OPTIONS" && request.headers.contains("origin") &&
        !is_ours(header(request, "origin"), request, names, local))
        return problem(403,
                       "a page of another site may not ask this gateway; if it is one of yours, "
                       "name its host in http: hosts",
                       "foreign-page");
    return std::nullopt;
}

}  // namespace panelgate::web
