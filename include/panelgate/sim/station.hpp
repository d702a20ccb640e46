#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::sim {

/// A panel that answers as its manual says, from its profile. Pure: time is an argument. Refers to
/// the profile, which must outlive it.
class Station {
  public:
    Station(const profile::PanelProfile& profile, std::uint8_t id);
    Station(Station&&) noexcept;
    Station& operator=(Station&&) noexcept;
    ~Station();

    std::uint8_t id() const;

    /// The reply PDU to a request PDU: normal or exception. `now` moves what moves (ramps, clocks).
    /// `wall` is local wall-clock time as seconds since 1970, for clock registers.
    Bytes handle(TimePoint now, std::int64_t wall, ByteView pdu);
    /// A broadcast: executed when the profile lets the function be broadcast, never answered.
    void broadcast(TimePoint now, std::int64_t wall, ByteView pdu);

    /// The panel ignores a request with such a pause between two of its characters (GT: more than
    /// 24 bit times, ARCT1F501E 1.2).
    bool minds_pause(Duration pause, const SerialFormat& format) const;

    /// Memory by area name; bits are 0 or 1. The area and the address must be the profile's.
    std::uint16_t peek(const std::string& area, std::uint32_t address) const;
    void poke(const std::string& area, std::uint32_t address, std::uint16_t value);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::sim
