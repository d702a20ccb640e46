#include "target.hpp"

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/utf8.hpp"
#include "to_lower.hpp"

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

/// Cuts off what comes before the separator; the rest (without it) stays in `text`.
std::string_view next_part(std::string_view& text, char separator) {
    const auto at = text.find(separator);
    const std::string_view part = text.substr(0, at);
    text = at == text.npos ? std::string_view() : text.substr(at + 1);
    return part;
}

/// Cuts off "http://host:port" (schemes are compared without case, RFC 3986 3.1). Nothing when
/// there is none.
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

std::optional<Target> parse_target(std::string_view target) {
    Target parsed;
    parsed.authority = take_authority(target);
    if (!parsed.authority && !target.starts_with('/')) return std::nullopt;
    target = next_part(target, '#');
    std::string_view path = next_part(target, '?');
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

}  // namespace panelgate::web
