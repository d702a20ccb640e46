#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::sim {

/// The memory of one panel: a word an item, but bit areas that are views of word areas share
/// theirs. Addresses must be readable in their area. Refers to the profile, which must outlive it.
class Memory {
  public:
    explicit Memory(const profile::PanelProfile& profile);

    std::uint16_t get(const profile::Area& area, std::uint32_t address) const;
    void set(const profile::Area& area, std::uint32_t address, std::uint16_t value);

  private:
    const profile::PanelProfile* profile_;
    std::map<std::string, std::vector<std::uint16_t>> words_;  ///< by area, from readable.first on
};

}  // namespace panelgate::sim
