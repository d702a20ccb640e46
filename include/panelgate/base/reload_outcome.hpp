#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace panelgate {

/// What came of reading the configuration again.
enum class ReloadOutcome : std::uint8_t {
    applied,
    unchanged,  ///< it says what is running
    invalid,    ///< it has faults, or cannot be read
    failed,     ///< it is valid, and a listener or a simulated line could not be opened
    refused,    ///< it is a way back that would weaken what protects, and nobody said so
};
inline constexpr std::array kReloadOutcomes{ReloadOutcome::applied, ReloadOutcome::unchanged,
                                            ReloadOutcome::invalid, ReloadOutcome::failed,
                                            ReloadOutcome::refused};
inline std::string_view label(ReloadOutcome outcome) {
    constexpr std::array<std::string_view, kReloadOutcomes.size()> kWords{
        "applied", "unchanged", "invalid", "failed", "refused"};
    return kWords[static_cast<std::size_t>(outcome)];
}

}  // namespace panelgate
