#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "loader.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::MapReader;

constexpr std::size_t kKiB = 1024;
constexpr std::array<std::pair<std::string_view, std::size_t>, 3> kUnits{
    {{"KiB", kKiB}, {"MiB", kKiB* kKiB}, {"GiB", kKiB* kKiB* kKiB}}};
constexpr std::size_t kSmallest = 64 * kKiB;
constexpr std::size_t kLargest = 4 * kKiB * kKiB * kKiB;

/// Parses "50MiB".
std::optional<std::size_t> parse_size(std::string_view text) {
    for (const auto& [name, bytes] : kUnits) {
        if (!text.ends_with(name)) continue;
        const std::string_view digits = text.substr(0, text.size() - name.size());
        std::uint32_t number = 0;
        const auto [end, wrong] =
            std::from_chars(digits.data(), digits.data() + digits.size(), number);
        const bool whole = wrong == std::errc{} && end == digits.data() + digits.size();
        if (!whole || digits.front() == '0') return std::nullopt;
        return number * bytes;
    }
    return std::nullopt;
}

void load_rotation(MapReader& in, audit::Settings& settings) {
    in.looks_like("rotate", "^[1-9][0-9]*(KiB|MiB|GiB)$");
    const auto typed = in.text("rotate");
    if (!typed) return;
    const auto bytes = parse_size(*typed);
    if (!bytes) {
        in.problem("rotate", "rotate must be a size such as 50MiB (KiB, MiB, GiB), not " +
                                 yaml::quote(*typed));
    } else if (*bytes < kSmallest || *bytes > kLargest) {
        in.problem("rotate", "rotate must be from " + size_text(kSmallest) + " to " +
                                 size_text(kLargest) + ", not " + *typed);
    } else {
        settings.rotate = *bytes;
    }
}

void load_file(MapReader& in, audit::Settings& settings) {
    in.looks_like("file", "^/.*[^/]$");
    const auto file = in.required_text("file");
    if (!file) return;
    if (!file->starts_with('/') || file->ends_with('/'))
        in.problem("file",
                   "file must be the whole path of a file, such as "
                   "/var/log/panelgate/audit.jsonl, not " +
                       yaml::quote(*file));
    settings.file = *file;
}

}  // namespace

std::string size_text(std::size_t bytes) {
    auto unit = kUnits.front();
    for (const auto& larger : kUnits)
        if (bytes % larger.second == 0 && bytes >= larger.second) unit = larger;
    return std::to_string(bytes / unit.second) + std::string(unit.first);
}

void load_audit(Loading& loading, MapReader& root) {
    load_section(loading, root, "audit", "{file: /var/log/panelgate/audit.jsonl}",
                 [&](MapReader& in) {
                     audit::Settings& settings = loading.config.audit.emplace();
                     load_file(in, settings);
                     load_rotation(in, settings);
                     audit_keys().read(in, settings);
                 });
}

}  // namespace panelgate::config
