#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/span.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a write leaves in its panel, to be held against what is read there afterwards. Pure.
class Verification {
  public:
    /// Nothing for what is not 05, 06, 0F, 10 or 16.
    static std::optional<Verification> of(const modbus::Request& write);

    /// The items that were written.
    const modbus::Span& span() const { return span_; }
    /// The same memory by a table that this panel can read it by; 422 when there is none.
    Parsed<modbus::Span> span_to_read(const profile::PanelProfile& panel) const;
    /// Do these items (bits as 0 and 1) hold what was written?
    bool holds(std::span<const std::uint16_t> items) const;

  private:
    struct Cell {
        std::uint16_t value = 0;
        std::uint16_t mask = 0xFFFF;  ///< the bits that were written
    };

    modbus::Span span_;
    std::vector<Cell> cells_;
};

}  // namespace panelgate::web
