#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
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

/// How a panel answers a request according to its manual, checked in the order of the Application
/// Protocol (chapter 7): function, quantity and structure, address.
enum class Judgement : std::uint8_t {
    fine,
    illegal_function,  ///< exception 01
    illegal_value,     ///< 03: structure or quantity
    illegal_address,   ///< 02: some items are outside the panel's memory
    write_protected,   ///< readable but not writable; the manuals disagree about the code
};

Judgement judge(const PanelProfile& profile, ByteView pdu);
Judgement judge(const PanelProfile& profile, const modbus::Request& request);
/// Returns why the request is not fine, as a clause for the user: "autonics-gplp-s has no function
/// 23".
std::string explain(const PanelProfile& profile, const modbus::Request& request);

/// Returns the area that contains the whole span, or nullptr.
const Area* find_readable(const PanelProfile& profile, const modbus::Span& span);

}  // namespace panelgate::profile
