#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/points/point.hpp"

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

/// The text in these registers, high byte first: up to the first NUL, at most `length` bytes,
/// without blanks at its end. What is not UTF-8 becomes U+FFFD, so that it can go into JSON.
std::string text_of_words(const std::vector<std::uint16_t>& words, unsigned length);

/// Filled up with NUL. The text fits.
std::vector<std::uint16_t> text_to_words(std::string_view text, unsigned count);

/// "NaN", "-inf", "Infinity", however it is written.
bool is_no_number(std::string text);

// Between a point's registers and its raw number; what decode and encode share.

using Words = std::vector<std::uint16_t>;

/// Into the standard's order, or out of it: it is its own inverse.
Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words);
/// The first word is the highest.
std::uint64_t joined(const Words& words);
Words parted(std::uint64_t raw, unsigned count);

/// Nothing for digits that are no BCD.
std::optional<std::int64_t> from_bcd(std::uint64_t raw, unsigned digits);
std::uint64_t to_bcd(std::uint64_t value);

inline bool is_bcd(Type type) { return type == Type::bcd16 || type == Type::bcd32; }
/// Neither scaled nor moved.
inline bool is_plain(const Point& point) { return point.scale == 1 && point.offset == 0; }
/// The value of this raw number.
double from_raw(const Point& point, double raw);

/// This raw number says that there is no value. As many low bits count as the type has: -1 and
/// 65535 are the same u16.
bool means_none(const Point& point, std::uint64_t number);
bool means_none(const Point& point, double number);

}  // namespace panelgate::points
