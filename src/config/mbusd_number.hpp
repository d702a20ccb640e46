#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace panelgate::config {

struct MbusdNumber {
    std::int64_t value = 0;
    bool plain = true;  ///< decimal, without anything behind it: nobody reads it otherwise
};

/// A number as mbusd reads it (strtoul() with base 0; cfg.c, cfg_handle_param()): 0x1F6, 010 for 8,
/// and whatever stands behind the digits is ignored. Nothing where there is no digit, of which
/// mbusd makes 0, and of what is negative or beyond 2^31 - 1.
std::optional<MbusdNumber> mbusd_number(std::string_view text);

}  // namespace panelgate::config
