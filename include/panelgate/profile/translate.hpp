#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// A function that a panel lacks, and one with the same effect.
struct Translation {
    std::uint8_t asked = 0;
    std::uint8_t sent = 0;
    friend bool operator==(const Translation&, const Translation&) = default;
};
/// Returns the translations that translate() may use for this panel.
std::vector<Translation> translations(const PanelProfile& profile);

/// Returns an equivalent request for a function that the panel lacks: a write of one item as a
/// write of several; a read of inputs as one of coils or holding registers if the profile says that
/// an area shows the same memory in both tables (`also`). nullopt: send the request unchanged.
std::optional<modbus::Request> translate(const PanelProfile& profile,
                                         const modbus::Request& request);

/// Returns everything that a write of these items changes, as the panel's tables show it: the
/// items, the same memory in other tables (`also`), the bits of words and the words of bits
/// (`view_of`).
std::vector<modbus::Span> shown_as(const PanelProfile& profile, const modbus::Span& written);

}  // namespace panelgate::profile
