#pragma once

#include <cstddef>

#include "panelgate/base/time.hpp"

namespace panelgate::web {

/// Limits of one request, and of the remembered writes with an Idempotency-Key.
struct ApiSettings {
    /// Per read: that many full ones take about 10 s at 19200 baud.
    unsigned max_transactions = 64;
    std::size_t max_items = 256;     ///< entries of one list
    std::size_t max_values = 32768;  ///< registers and bits of all its entries
    Duration keys_kept = 10min;      ///< how long the result of a write with a key is remembered
    std::size_t max_keys = 4096;     ///< of finished and running writes together
    std::size_t max_keys_of_client = 1024;   ///< per client
    std::size_t max_key = 255;               ///< characters of a key
    std::size_t max_kept = 8 * 1024 * 1024;  ///< bytes of remembered answers
    std::size_t gzip_from =
        1400;  ///< bytes of a body; a smaller one fits one packet and is not packed
};

}  // namespace panelgate::web
