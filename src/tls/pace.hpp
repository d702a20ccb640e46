#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::tls {

/// Spreads what begins: of an address, and of all together, a share at once, then evenly.
/// Time is an argument. Pure.
class Pace {
  public:
    Pace(std::size_t of_address_per_second, std::size_t of_all_per_second);

    /// How long the next one of this address waits; it counts from then on.
    Duration wait(TimePoint now, const std::string& address);
    /// One that waited does not begin after all.
    void give_back(const std::string& address);
    /// Addresses that are remembered: those that have had one within the last seconds.
    std::size_t addresses() const { return addresses_.size(); }

  private:
    Duration of_address_;  ///< between two
    Duration of_all_;
    TimePoint all_{};  ///< when the next one is expected, if they come evenly
    std::map<std::string, TimePoint> addresses_;  ///< the same, of each
};

}  // namespace panelgate::tls
