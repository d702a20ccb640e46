#include "conduct.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <utility>

#include "costs.hpp"
#include "keyed.hpp"
#include "packing.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "patience.hpp"

namespace panelgate::web {
namespace {

std::string header(const HttpRequest& request, const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : found->second;
}

/// Behind a member's name that ends in _ms: its number; behind `time`: the instant.
std::size_t end_of_age(std::string_view body, std::size_t at) {
    constexpr std::string_view kAge = "_ms\":";
    constexpr std::string_view kTime = "\"time\":\"";
    if (body.substr(at).starts_with(kTime))
        return std::min(body.find('"', at + kTime.size()), body.size() - 1) + 1;
    if (!body.substr(at).starts_with(kAge)) return at;
    at += kAge.size();
    while (at < body.size() && body[at] != ',' && body[at] != '}') ++at;
    return at;
}

/// Has it a body that others would be sent, too, in another coding?
bool is_packable(const HttpResponse& response, std::size_t from) {
    if (response.events || response.shared_body || response.status == 304) return false;
    for (const auto& [name, value] : response.headers)
        if (name == "Content-Encoding") return false;
    return response.body.size() >= from;
}

/// Behind what the answer varies with already.
void add_vary(HttpResponse& response, const std::string& name) {
    for (auto& [header, value] : response.headers) {
        if (header != "Vary") continue;
        if (value.find(name) == std::string::npos) value += ", " + name;
        return;
    }
    response.headers.emplace_back("Vary", name);
}

void set_tag(HttpResponse& response, const std::string& if_none_match) {
    if (tell_tag(response, if_none_match, tag_of(response.body))) response.body.clear();
}

Handling handled(HttpRequest request, const Api* api, Handler handler, Manner manner) {
    if (manner.once) return keyed(std::move(request), api, handler);
    if (manner.asks) return costed(std::move(request), api, handler);
    return handler(std::move(request), api);
}

}  // namespace

std::string tag_of(std::string_view body) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (std::size_t at = 0; at < body.size();) {
        const std::size_t behind = end_of_age(body, at);
        if (behind != at) {
            at = behind;
            continue;
        }
        hash = (hash ^ static_cast<unsigned char>(body[at])) * 1099511628211u;
        ++at;
    }
    std::array<char, 32> text{};
    const int size = std::snprintf(text.data(), text.size(), "W/\"%016llx\"",
                                   static_cast<unsigned long long>(hash));
    return std::string(text.data(), static_cast<std::size_t>(size));
}

bool names_tag(std::string_view if_none_match, std::string_view tag) {
    constexpr std::string_view kWeak = "W/";
    if (if_none_match == "*") return true;
    tag.remove_prefix(kWeak.size());
    for (auto at = if_none_match.find(tag); at != if_none_match.npos;
         at = if_none_match.find(tag, at + 1)) {
        const std::string_view rest = if_none_match.substr(at + tag.size());
        if (rest.empty() || rest.front() == ',' || rest.front() == ' ') return true;
    }
    return false;
}

bool tell_tag(HttpResponse& response, std::string_view if_none_match, const std::string& tag) {
    response.headers.emplace_back("ETag", tag);
    const bool known = names_tag(if_none_match, tag);
    if (known) response.status = 304;
    return known;
}

Handling conduct(HttpRequest request, const Api* api, Handler handler, Manner manner) {
    const std::shared_ptr<Caller> caller = request.caller;
    const std::size_t gzip_from = api->providers.settings.gzip_from;
    const bool takes_gzip = accepts_gzip(header(request, "accept-encoding"));
    const std::string if_none_match = header(request, "if-none-match");
    const auto wait = manner.asks ? wait_of(request) : std::nullopt;
    Handling work = handled(std::move(request), api, handler, manner);
    HttpResponse response = co_await std::move(work);
    if (caller->has_left()) co_return response;
    if (wait) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(*wait).count();
        response.headers.emplace_back("Preference-Applied", "wait=" + std::to_string(seconds));
    }
    if (manner.tagged && response.status == 200) set_tag(response, if_none_match);
    if (!is_packable(response, gzip_from)) co_return response;
    add_vary(response, "Accept-Encoding");
    if (!takes_gzip) co_return response;
    response.made = response.body.size();
    boost::asio::awaitable<std::string> packing = packed(std::move(response.body));
    response.body = co_await std::move(packing);
    response.headers.emplace_back("Content-Encoding", "gzip");
    co_return response;
}

}  // namespace panelgate::web
