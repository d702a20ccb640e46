#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tables.hpp"

namespace panelgate::config {

namespace {

constexpr std::size_t kKiB = 1024;
constexpr std::array<std::pair<std::string_view, std::size_t>, 3> kUnits{
    {{"KiB", kKiB}, {"MiB", kKiB* kKiB}, {"GiB", kKiB* kKiB* kKiB}}};
constexpr std::size_t kSmallest = 64 * kKiB;
constexpr std::size_t kLargest = 4 * kKiB * kKiB * kKiB;

/// Parses "50MiB".
std::optional<std::size_t> parse_size(std::string_view text) {
    for (const auto& [name, bytes] : kUnits) {
        if (!text.ends_with(name)) continue;
        const auto number = yaml::parse_integer(text.substr(0, text.size() - name.size()));
        constexpr std::int64_t kMost = 1 << 30;
        if (!number || *number < 1 || *number > kMost) return std::nullopt;
        return static_cast<std::size_t>(*number) * bytes;
    }
    return std::nullopt;
}

std::string size_text(std::size_t bytes) {
    auto unit = kUnits.front();
    for (const auto& larger : kUnits)
        if (bytes % larger.second == 0 && bytes >= larger.second) unit = larger;
    return std::to_string(bytes / unit.second) + std::string(unit.first);
}

/// Keys of former versions.
constexpr std::array<yaml::Elsewhere, 1> kGone{
    {{"syslog", {}, {}, "let the machine's syslog read the file, as imfile of rsyslog does"}}};

bool read_size(Reader& in, audit::Settings& settings) {
    in.elsewhere(kGone);
    const auto typed = in.text("rotate");
    if (!typed) return false;
    const auto bytes = parse_size(*typed);
    const bool fits = bytes && *bytes >= kSmallest && *bytes <= kLargest;
    if (!fits)
        in.problem("rotate", "rotate must be a size such as 50MiB (KiB, MiB, GiB), from " +
                                 size_text(kSmallest) + " to " + size_text(kLargest) + ", not " +
                                 yaml::quote(*typed));
    settings.rotate = fits ? *bytes : settings.rotate;
    return fits;
}

std::string file_fault(std::string_view typed) {
    if (typed.starts_with('/') && !typed.ends_with('/')) return "";
    return "file must be the whole path of a file, such as /var/log/panelgate/audit.jsonl, not " +
           yaml::quote(typed);
}

}  // namespace

const Keys<audit::Settings>& audit_keys() {
    using audit::OnFailure;
    using audit::Settings;
    static constexpr Words<OnFailure, 2> kFailures{
        {{"continue", OnFailure::keep_on}, {"refuse_writes", OnFailure::refuse_writes}}};
    static const auto kKeys =
        Keys<Settings>()
            .text("file", &Settings::file, {"^/.*[^/]$", false, 0, file_fault},
                  "File that is written; full ones beside it have a number behind the name.")
            .weaker(By::any)
            .required()
            .example("/var/log/panelgate/audit.jsonl")
            .value(text_shape("rotate", {"^[1-9][0-9]*(KiB|MiB|GiB)$"},
                              "Size of a file, such as 50MiB; then the next one begins."),
                   read_size, [](const Settings& of) { return size_text(of.rotate); })
            .weaker(By::falling)
            .integer("keep", &Settings::keep, 1, 10'000, "Full files that are kept.")
            .weaker(By::falling)
            .word("on_failure", &Settings::on_failure, kFailures,
                  "What happens while the disk takes nothing: continue, which may lose records, or "
                  "refuse_writes (exception 06).")
            .weaker(By::leaving, "refuse_writes");
    return kKeys;
}

}  // namespace panelgate::config
