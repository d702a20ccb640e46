#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/mqtt/publisher.hpp"

namespace panelgate::mqtt {

/// Which texts keep the changes that wait for the broker over a restart: one of each change, by a
/// key that begins with kPrefix. Nothing is written while the broker is connected. Pure.
class Outbox {
  public:
    static constexpr std::string_view kPrefix = "mqtt/";
    static constexpr std::size_t kTurn = 1000;  ///< texts of one next() at most

    using Texts = std::vector<std::pair<std::string, std::string>>;  ///< key, text; "": forget it

    /// What is to be kept or forgotten now. Call once a second, and at the end.
    Texts next(const Publisher& publisher);
    /// Puts the changes of these texts, as they were kept, into the publisher's store. Changes of
    /// subjects that are gone are left out.
    void restore(Publisher& publisher, const Texts& kept);

  private:
    std::vector<std::uint64_t> kept_;  ///< numbers, rising
    std::vector<std::string> stale_;   ///< keys to be forgotten
};

}  // namespace panelgate::mqtt
