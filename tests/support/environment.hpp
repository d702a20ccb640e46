#pragma once

#include <cstdint>
#include <cstdlib>

namespace panelgate::test {

/// What the environment says, for those who want a test to be longer, or one seed of it.
inline std::uint64_t number_from(const char* variable, std::uint64_t fallback) {
    const char* text = std::getenv(variable);
    return text == nullptr ? fallback : std::strtoull(text, nullptr, 10);
}

/// What a test plays, by default `usual`: a tenth of it where a sanitizer takes its time.
inline std::uint64_t amount_from(const char* variable, std::uint64_t usual) {
    const std::uint64_t all = number_from(variable, usual);
    return number_from("PANELGATE_SANITIZED", 0) != 0 ? all / 10 : all;
}

}  // namespace panelgate::test
