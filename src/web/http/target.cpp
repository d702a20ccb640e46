#include "target.hpp"

#include "panelgate/base/bytes.hpp"

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
    return out;
}

/// Cuts off what comes before the separator; the rest (without it) stays in `text`.
std::string_view next_part(std::string_view& text, char separator) {
    const auto at = text.find(separator);
    const std::string_view part = text.substr(0, at);
    text = at == text.npos ? std::string_view() : text.substr(at + 1);
    return part;
}

}  // namespace

std::optional<Target> parse_target(std::string_view target) {
    if (!target.starts_with('/')) return std::nullopt;
    target = next_part(target, '#');
    std::string_view path = next_part(target, '?');
    path.remove_prefix(1);
    Target parsed;
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
        if (!parsed.query.emplace(*name, std::move(*value)).second) parsed.repeated_query = *name;
    }
    return parsed;
}

}  // namespace panelgate::web
