#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tables.hpp"

namespace panelgate::config {

namespace {

constexpr std::size_t kSmallest = 64 * 1024;
constexpr std::size_t kLargest = std::size_t{4} * 1024 * 1024 * 1024;

/// Keys of former versions.
constexpr std::array<yaml::Elsewhere, 1> kGone{
    {{"syslog", {}, {}, "let the machine's syslog read the file, as imfile of rsyslog does"}}};

bool read_rotate(Reader& in, audit::Settings& settings) {
    in.elsewhere(kGone);
    const auto size = read_size(in, "rotate", kSmallest, kLargest);
    settings.rotate = size.value_or(settings.rotate);
    return size.has_value();
}

}  // namespace

const Keys<audit::Settings>& audit_keys() {
    using audit::OnFailure;
    using audit::Settings;
    static constexpr Words<OnFailure, 2> kFailures{
        {{"continue", OnFailure::keep_on}, {"refuse_writes", OnFailure::refuse_writes}}};
    static const auto kKeys =
        Keys<Settings>()
            .text("file", &Settings::file, whole_path("/var/log/panelgate/audit.jsonl"),
                  "File that is written; full ones beside it have a number behind the name.")
            .weaker(By::any)
            .required()
            .example("/var/log/panelgate/audit.jsonl")
            .value(size_shape("rotate", "Size of a file, such as 50MiB; then the next one begins."),
                   read_rotate, [](const Settings& of) { return size_text(of.rotate); })
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
