#include "patience.hpp"

#include <algorithm>
#include <chrono>

#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace {

constexpr unsigned kLongest = 86400;  ///< s: whoever waits for longer waits for the deadline

std::string_view trimmed(std::string_view text) {
    while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
    while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
    return text;
}

std::string_view unquoted(std::string_view text) {
    if (text.size() < 2 || !text.starts_with('"') || !text.ends_with('"')) return text;
    return text.substr(1, text.size() - 2);
}

}  // namespace

std::optional<Duration> wait_of(std::string_view prefer) {
    while (!prefer.empty()) {
        const auto comma = std::min(prefer.find(','), prefer.size());
        const std::string_view item = prefer.substr(0, comma);
        prefer.remove_prefix(std::min(comma + 1, prefer.size()));
        const std::string_view preference = item.substr(0, item.find(';'));
        const auto equals = preference.find('=');
        if (equals == preference.npos || trimmed(preference.substr(0, equals)) != "wait") continue;
        const auto seconds = to_number(unquoted(trimmed(preference.substr(equals + 1))));
        if (!seconds) return std::nullopt;
        return std::chrono::seconds(std::min(*seconds, kLongest));
    }
    return std::nullopt;
}

std::optional<Duration> wait_of(const HttpRequest& request) {
    const auto prefer = request.headers.find("prefer");
    return prefer == request.headers.end() ? std::nullopt : wait_of(prefer->second);
}

Patience::Patience(const HttpRequest& request, Duration deadline,
                   const std::function<TimePoint()>& now)
    : now_(&now), end_(now() + std::min(deadline, wait_of(request).value_or(deadline))) {}

Duration Patience::left() const { return std::max(Duration::zero(), end_ - (*now_)()); }

}  // namespace panelgate::web
