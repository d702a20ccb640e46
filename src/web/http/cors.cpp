#include "cors.hpp"

#include <algorithm>

#include "admission.hpp"

namespace panelgate::web {

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
