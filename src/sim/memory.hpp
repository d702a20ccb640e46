#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::sim {

/// Memory of one panel: a word per item, but bit areas that are views of word areas share theirs.
/// Addresses must be readable in their area. The profile must outlive it.
class Memory {
  public:
    explicit Memory(const profile::PanelProfile& profile);

    std::uint16_t get(const profile::Area& area, std::uint32_t address) const;
    void set(const profile::Area& area, std::uint32_t address, std::uint16_t value);

  private:
    const profile::PanelProfile* profile_;
    std::map<std::string, std::vector<std::uint16_t>> words_;  ///< by area, from readable.first on
};

/// Returns the reply to a well-formed request that touches no memory: 07 (always 0), 08/00, 0B, 11
/// and 2B/0E with the basic objects (AP 6.7 to 6.9, 6.13, 6.21). Exception 01 for everything else.
/// `events` is the count for 0B: requests answered normally, except 0B itself.
Bytes identity_reply(std::string_view profile_name, std::uint8_t station, std::uint16_t events,
                     ByteView pdu);

}  // namespace panelgate::sim
