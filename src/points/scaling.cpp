#include "scaling.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <system_error>

namespace panelgate::points {
namespace {

constexpr std::int64_t kExact = std::int64_t{1}
                                << 53;  ///< a double holds every whole number to here
constexpr int kMostDigits = 18;         ///< of an int64, whatever they are
constexpr double kTens[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                            1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};

}  // namespace

Scaling::Scaling(double scale, double offset)
    : scale_(scale),
      offset_(offset),
      decimal_scale_(decimal_of(scale)),
      decimal_offset_(decimal_of(offset)) {
    if (decimal_scale_ && decimal_offset_)
        whole_ = whole(std::min({0, decimal_scale_->exponent, decimal_offset_->exponent}));
}

/// The shortest digits that mean this double.
std::optional<Scaling::Decimal> Scaling::decimal_of(double number) {
    char buffer[32];
    const auto [end, error] =
        std::to_chars(buffer, buffer + sizeof buffer, number, std::chars_format::scientific);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    Decimal decimal;
    bool fraction = false;
    const char* at = buffer;
    for (; at != end && *at != 'e'; ++at) {
        if (*at == '.') {
            fraction = true;
        } else if (*at != '-') {
            decimal.digits = decimal.digits * 10 + (*at - '0');
            decimal.exponent -= fraction ? 1 : 0;
        }
    }
    if (number < 0) decimal.digits = -decimal.digits;
    int exponent = 0;
    at += at != end && at[1] == '+' ? 2 : 1;
    std::from_chars(at, end, exponent);
    decimal.exponent += exponent;
    return decimal;
}

/// digits * 10^by, where that fits.
std::optional<std::int64_t> Scaling::shifted(std::int64_t digits, int by) {
    if (digits == 0) return 0;
    if (by < 0 || by > kMostDigits) return std::nullopt;
    std::int64_t result = digits;
    for (; by > 0; --by) {
        if (__builtin_mul_overflow(result, std::int64_t{10}, &result)) return std::nullopt;
    }
    return result;
}

std::optional<Scaling::Whole> Scaling::whole(int exponent) const {
    const auto scale = shifted(decimal_scale_->digits, decimal_scale_->exponent - exponent);
    const auto offset = shifted(decimal_offset_->digits, decimal_offset_->exponent - exponent);
    if (!scale || !offset || *scale == 0 || exponent < -kMostDigits) return std::nullopt;
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

double Scaling::raw_of(double value) const {
    const double inverse = std::round(1 / scale_);
    if (std::abs(scale_) < 1 && 1 / inverse == scale_) return (value - offset_) * inverse;
    return (value - offset_) / scale_;
}

std::optional<std::int64_t> Scaling::exact_raw_of(const Decimal& value) const {
    if (!whole_) return std::nullopt;
    const auto common = whole(std::min(whole_->exponent, value.exponent));
    if (!common) return std::nullopt;
    const auto digits = shifted(value.digits, value.exponent - common->exponent);
    std::int64_t above = 0;
    if (!digits || __builtin_sub_overflow(*digits, common->offset, &above)) return std::nullopt;
    constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
    if (above == kLeast || above % common->scale != 0) return std::nullopt;
    return above / common->scale;
}

std::optional<std::int64_t> Scaling::exact_raw_of(double value) const {
    const auto decimal = decimal_of(value);
    if (!decimal) return std::nullopt;
    if (const auto raw = exact_raw_of(*decimal)) {
        // Beyond, the next raw number may be the same double.
        return std::abs(*raw) <= kExact ? raw : std::nullopt;
    }
    // What a client was shown it may write back, digits or not.
    const double nearest = std::round(raw_of(value));
    if (std::abs(nearest) > static_cast<double>(kExact) || value_of(nearest) != value)
        return std::nullopt;
    return static_cast<std::int64_t>(nearest);
}

std::optional<std::int64_t> Scaling::exact_raw_of(std::int64_t value) const {
    if (const auto raw = exact_raw_of(Decimal{value, 0})) return raw;
    if (value > kExact || value < -kExact) return std::nullopt;
    return exact_raw_of(static_cast<double>(value));
}

std::optional<std::int64_t> Scaling::exact_raw_of(std::uint64_t value) const {
    constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
    int exponent = 0;
    for (; value > kMost && value % 10 == 0; value /= 10) ++exponent;
    if (value > kMost) return std::nullopt;
    const auto digits = static_cast<std::int64_t>(value);
    return exponent == 0 ? exact_raw_of(digits) : exact_raw_of(Decimal{digits, exponent});
}

}  // namespace panelgate::points
