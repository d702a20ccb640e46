#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace panelgate {

/// How a request ended, as its client sees it.
enum class Outcome : std::uint8_t {
    ok,
    exception,  ///< the panel's own
    timeout,
    damaged,
    refused,  ///< it never had a way to a panel
    busy,
    expired,
    cancelled,
    offline,
    line_down,
    cached,  ///< a value that was read before
    shared,  ///< by another request's transaction
};
inline constexpr std::array kAllOutcomes{Outcome::ok,        Outcome::exception, Outcome::timeout,
                                         Outcome::damaged,   Outcome::refused,   Outcome::busy,
                                         Outcome::expired,   Outcome::cancelled, Outcome::offline,
                                         Outcome::line_down, Outcome::cached,    Outcome::shared};

/// The word of panelgate_requests_total{outcome} and of a transaction's event.
std::string_view label(Outcome outcome);

/// One count for each outcome.
class OutcomeCounts {
  public:
    std::uint64_t& operator[](Outcome outcome) {
        return counts_[static_cast<std::size_t>(outcome)];
    }
    std::uint64_t operator[](Outcome outcome) const {
        return counts_[static_cast<std::size_t>(outcome)];
    }

  private:
    std::array<std::uint64_t, kAllOutcomes.size()> counts_{};
};

}  // namespace panelgate
