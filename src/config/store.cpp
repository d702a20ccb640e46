#include <cstdint>

#include "tables.hpp"

namespace panelgate::config {

namespace {

constexpr std::uint64_t kSmallest = 8 * 1024 * 1024;
constexpr std::uint64_t kLargest = std::uint64_t{64} * 1024 * 1024 * 1024;

}  // namespace

const Keys<store::Settings>& store_keys() {
    using store::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .text("file", &Settings::file, whole_path("/var/lib/panelgate/state.db"),
                  "SQLite file of events and history; without it state.db in $STATE_DIRECTORY, or "
                  "nothing but memory.")
            .example("/var/lib/panelgate/state.db")
            .value(
                size_shape("size", "Size that the file may have; then the oldest goes."),
                [](Reader& in, Settings& into) {
                    const auto size = read_size(in, "size", kSmallest, kLargest);
                    into.size = size.value_or(into.size);
                    return size.has_value();
                },
                [](const Settings& of) { return size_text(of.size); })
            .integer("days", &Settings::days, 1, 3650, "Days that events and history are kept.");
    return kKeys;
}

}  // namespace panelgate::config
