#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::sim {

/// A panel that replies as its manual specifies, from its profile. Pure: time is an argument. The
/// profile must outlive it.
class Station {
  public:
    Station(const profile::PanelProfile& profile, std::uint8_t id);
    Station(Station&&) noexcept;
    Station& operator=(Station&&) noexcept;
    ~Station();

    std::uint8_t id() const;

    /// Returns the reply PDU: normal or exception. `now` drives changing values (ramps, clocks).
    /// `wall` is local wall-clock time as seconds since 1970, for clock registers.
    Bytes handle(TimePoint now, std::int64_t wall, ByteView pdu);
    /// Executes a broadcast if the profile allows it for the function; never replies.
    void broadcast(TimePoint now, std::int64_t wall, ByteView pdu);

    /// True if the panel ignores a request with such a gap between two characters (GT: more than 24
    /// bit times, ARCT1F501E 1.2).
    bool rejects_gap(Duration pause, const SerialFormat& format) const;

    /// Accesses memory by area name; bits are 0 or 1. Area and address must be the profile's.
    std::uint16_t peek(const std::string& area, std::uint32_t address) const;
    void poke(const std::string& area, std::uint32_t address, std::uint16_t value);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::sim
