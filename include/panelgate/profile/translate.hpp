#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {

/// A function that a panel lacks, and the one that does the same.
struct Translation {
    std::uint8_t asked = 0;
    std::uint8_t sent = 0;
    friend bool operator==(const Translation&, const Translation&) = default;
};
/// What translate() may do for this panel, by the function asked.
std::vector<Translation> translations(const PanelProfile& profile);

/// How this panel can be asked what it has no function for: a write of one item by the function
/// for several; a read of inputs by that of coils or holding registers where the profile says that
/// an area shows the same memory through both (`also`). Nothing: the request goes as it is.
std::optional<modbus::Request> translate(const PanelProfile& profile,
                                         const modbus::Request& request);

/// Everything that a write of these items changes, as the panel's tables show it: the items, the
/// same memory by other tables (`also`), words by their bits and bits by their words (`view_of`).
std::vector<modbus::Span> shown_as(const PanelProfile& profile, const modbus::Span& written);

}  // namespace panelgate::profile
