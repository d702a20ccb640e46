#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/decimal.hpp"

namespace panelgate::points {

/// value = raw * scale + offset in decimal numbers, as people write them: 3 * 0.1 is 0.3, and 21.5
/// is exactly 215 tenths though no binary fraction is a tenth.
class Scaling {
  public:
    /// Finite ones; the scale is not 0.
    Scaling(double scale, double offset);

    /// The double nearest to the decimal value, as far as 15 digits hold it.
    double value_of(double raw) const;
    /// With all its digits.
    Decimal value_of(const Decimal& raw) const;
    /// Not rounded.
    double raw_of(double value) const;
    /// The whole raw numbers around this value.
    Decimal::Around around(const Decimal& value) const;
    /// The whole raw number whose value this is, or is shown as this, or as this in the 17 digits
    /// with which some write every double; nothing when there is none or several.
    std::optional<Decimal> exact_raw_of(const Decimal& value) const;

  private:
    /// Scale and offset as whole numbers of 10^exponent.
    struct Whole {
        std::int64_t scale = 1;
        std::int64_t offset = 0;
        int exponent = 0;  ///< 0 or less
    };
    std::optional<Whole> whole() const;
    std::optional<Decimal> raw_shown_as(double value) const;

    double scale_;
    double offset_;
    Decimal decimal_scale_;
    Decimal decimal_offset_;
    std::optional<Whole> whole_;  ///< nothing: their digits lie too far apart
};

}  // namespace panelgate::points
