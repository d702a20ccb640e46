#pragma once

#include <cstddef>
#include <optional>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// For whose sake every broadcast through this listener is refused (01): a read-only station that
/// it would reach. Nullptr: nobody's, or there are none.
const Station* forbids_broadcasts(const Config& config, const tcp_server::Settings& listener);

/// Many clients have this timeout, and some cannot be told another one.
inline constexpr Duration kQuickClient = 500ms;

/// What would make a line answer quick clients in time.
struct QuickSettings {
    Duration deadline{};          ///< of the queue
    Duration response_timeout{};  ///< of all stations: all attempts of a read fit
    int retries = 0;
    /// Longer reads take too long on this wire; nothing: every read fits.
    std::optional<std::size_t> most_registers;
};
struct ClientTimeout {
    Duration worst{};  ///< every request is answered by then (P3): a client has to wait for longer
    /// Nothing where it is quick enough, or where no setting makes it so.
    std::optional<QuickSettings> quick;
};

ClientTimeout client_timeout(const Line& line);

}  // namespace panelgate::config
