#pragma once

#include <cstdint>
#include <optional>

namespace panelgate::points {

/// value = raw * scale + offset in decimal numbers, as people write them: 3 * 0.1 is 0.3, and 21.5
/// is exactly 215 tenths though no binary fraction is a tenth.
class Scaling {
  public:
    Scaling(double scale, double offset);

    bool is_plain() const { return scale_ == 1 && offset_ == 0; }
    /// The double nearest to the decimal value, as far as 15 digits hold it.
    double value_of(double raw) const;
    /// Not rounded.
    double raw_of(double value) const;
    /// The whole raw number whose value this is, or is shown as this; nothing when there is none,
    /// and beyond 2^53, where a double may be several.
    std::optional<std::int64_t> exact_raw_of(double value) const;
    /// … of a whole value, beyond what a double holds.
    std::optional<std::int64_t> exact_raw_of(std::int64_t value) const;
    std::optional<std::int64_t> exact_raw_of(std::uint64_t value) const;

  private:
    /// digits * 10^exponent
    struct Decimal {
        std::int64_t digits = 0;
        int exponent = 0;
    };
    /// Scale and offset as whole numbers of 10^exponent.
    struct Whole {
        std::int64_t scale = 1;
        std::int64_t offset = 0;
        int exponent = 0;  ///< 0 or less
    };
    static std::optional<Decimal> decimal_of(double number);
    static std::optional<std::int64_t> shifted(std::int64_t digits, int by);
    std::optional<Whole> whole(int exponent) const;
    std::optional<std::int64_t> exact_raw_of(const Decimal& value) const;

    double scale_;
    double offset_;
    std::optional<Decimal> decimal_scale_;
    std::optional<Decimal> decimal_offset_;
    std::optional<Whole> whole_;  ///< nothing: their digits lie too far apart
};

}  // namespace panelgate::points
