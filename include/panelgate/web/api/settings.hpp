#pragma once

#include <cstddef>

#include "panelgate/base/time.hpp"

namespace panelgate::web {

/// What one request may cost, and what is remembered of requests.
struct ApiSettings {
    /// Of one read: at 19200 baud as many full ones take about 10 s.
    unsigned max_transactions = 64;
    std::size_t max_items = 256;             ///< entries of one list
    std::size_t max_values = 32768;          ///< registers and bits of all its entries
    Duration keys_kept = 10min;              ///< what became of a write that had a key
    std::size_t max_keys = 4096;             ///< remembered, or under way
    std::size_t max_keys_of_client = 1024;   ///< of these
    std::size_t max_key = 255;               ///< characters of one
    std::size_t max_kept = 8 * 1024 * 1024;  ///< bytes of remembered answers
    std::size_t gzip_from = 1400;  ///< bytes of a body: what one packet holds goes as it is
};

}  // namespace panelgate::web
