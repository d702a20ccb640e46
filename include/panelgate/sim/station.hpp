#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::sim {

/// A panel that answers as its manual says, from its profile. Pure: time is an argument. Refers to
/// the profile, which must outlive it.
class Station {
  public:
    Station(const profile::PanelProfile& profile, std::uint8_t id);

    std::uint8_t id() const { return id_; }

    /// The reply PDU to a request PDU: normal or exception. `now` moves what moves (ramps, clocks).
    /// `wall` is local wall-clock time as seconds since 1970, for clock registers.
    Bytes handle(TimePoint now, std::int64_t wall, ByteView pdu);
    /// A broadcast: executed when the profile lets the function be broadcast, never answered.
    void broadcast(TimePoint now, std::int64_t wall, ByteView pdu);

    /// Memory by area name; bits are 0 or 1. For tests and start values.
    std::uint16_t peek(const std::string& area, std::uint32_t address) const;
    void poke(const std::string& area, std::uint32_t address, std::uint16_t value);

  private:
    Bytes execute(ByteView pdu);
    void move(TimePoint now, std::int64_t wall);

    const profile::PanelProfile& profile_;
    std::uint8_t id_;
    std::map<std::string, std::vector<std::uint16_t>> words_;  ///< by area; bit areas one word a bit
    TimePoint started_{};
    bool running_ = false;
};

}  // namespace panelgate::sim
