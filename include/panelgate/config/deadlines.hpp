#pragma once

#include <cstddef>
#include <optional>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Returns the read-only station that makes the listener refuse every broadcast (01); nullptr
/// without such a station.
const Station* forbids_broadcasts(const Config& config, const tcp_server::Settings& listener);

/// A common client timeout, which some clients cannot change.
inline constexpr Duration kQuickClient = 500ms;

/// Settings with which a line answers clients with a short timeout in time.
struct QuickSettings {
    Duration deadline{};          ///< of the queue
    Duration response_timeout{};  ///< of all stations, so that all attempts of a read fit
    int retries = 0;
    /// Longer reads take too long on this wire; empty: every read fits.
    std::optional<std::size_t> most_registers;
};
struct ClientTimeout {
    Duration worst{};  ///< every request is answered by then (P3): clients need a longer timeout
    /// Empty if the panel is quick enough, or if no setting makes the panel quick enough.
    std::optional<QuickSettings> quick;
};

ClientTimeout client_timeout(const Line& line);

}  // namespace panelgate::config
