#include "scaling.hpp"

#include <algorithm>
#include <cmath>

namespace panelgate::points {
namespace {

constexpr std::int64_t kExact = std::int64_t{1}
                                << 53;  ///< a double holds every whole number to here
constexpr int kMostDigits = 18;         ///< of an int64, whatever they are
constexpr int kEveryDouble = 17;        ///< digits that tell any two doubles apart
constexpr double kTens[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                            1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};

}  // namespace

Scaling::Scaling(double scale, double offset)
    : scale_(scale),
      offset_(offset),
      decimal_scale_(scale),
      decimal_offset_(offset),
      whole_(whole()) {}

std::optional<Scaling::Whole> Scaling::whole() const {
    const int exponent = std::min({0, decimal_scale_.exponent(), decimal_offset_.exponent()});
    if (exponent < -kMostDigits) return std::nullopt;
    const auto scale = decimal_scale_.shifted(-exponent).as_int64();
    const auto offset = decimal_offset_.shifted(-exponent).as_int64();
    if (!scale || !offset) return std::nullopt;
    return Whole{*scale, *offset, exponent};
}

double Scaling::value_of(double raw) const {
    const bool is_whole = raw == std::floor(raw) && std::abs(raw) <= static_cast<double>(kExact);
    if (whole_ && is_whole) {
        std::int64_t sum = 0;
        const bool fits =
            !__builtin_mul_overflow(static_cast<std::int64_t>(raw), whole_->scale, &sum) &&
            !__builtin_add_overflow(sum, whole_->offset, &sum) && sum <= kExact && sum >= -kExact;
        // Both are exact, so the quotient is the nearest double there is.
        if (fits) return static_cast<double>(sum) / kTens[-whole_->exponent];
    }
    return raw * scale_ + offset_;
}

Decimal Scaling::value_of(const Decimal& raw) const {
    return raw * decimal_scale_ + decimal_offset_;
}

double Scaling::raw_of(double value) const {
    const double inverse = std::round(1 / scale_);
    if (std::abs(scale_) < 1 && 1 / inverse == scale_) return (value - offset_) * inverse;
    return (value - offset_) / scale_;
}

Decimal::Around Scaling::around(const Decimal& value) const {
    return (value + -decimal_offset_).divided_by(decimal_scale_);
}

/// Not that of another one as well.
std::optional<Decimal> Scaling::raw_shown_as(double value) const {
    const auto whole = around(value);
    if (whole.below == whole.above) return whole.nearest;
    const double raw = whole.nearest.nearest();
    if (std::abs(raw) >= static_cast<double>(kExact) || value_of(raw) != value ||
        value_of(raw - 1) == value || value_of(raw + 1) == value)
        return std::nullopt;
    return whole.nearest;
}

std::optional<Decimal> Scaling::exact_raw_of(const Decimal& value) const {
    const auto whole = around(value);
    if (whole.below == whole.above) return whole.nearest;
    const double nearest = value.nearest();
    if (value == Decimal(nearest) || value == Decimal::exactly(nearest, kEveryDouble))
        return raw_shown_as(nearest);
    return std::nullopt;
}

}  // namespace panelgate::points
